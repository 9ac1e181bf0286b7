use super::algebra::{Quat, Symmetric, Vec3};
use super::lanes::{LANES, Lanes, Work, on_widest_lanes};
use super::state::State;
use super::step::{Lane, Workspace};
use super::tree::Tree;
use crate::sim::{Character, LinkState, Settings};
use crate::skeleton::Skeleton;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use wide::f32x8;

/// Rotations from none to almost a full turn, about axes that differ.
fn rotation_vectors() -> Vec<Vector3<f32>> {
    let lengths = [
        0.0, 1e-30, 1e-12, 1e-4, 0.01, 0.3, 1.2, 1.6, 2.2, 3.0, 3.13, 3.5, 4.7, 5.5, 6.2,
    ];
    let axis = |i: usize| {
        let i = i as f32;
        Vector3::new(i.sin(), (2.3 * i).cos(), (1.7 * i + 0.4).sin()).normalize()
    };
    let all = lengths.iter().enumerate();
    all.map(|(i, length)| axis(i) * *length).collect()
}

#[test]
fn turns_by_rotation_vectors_are_those_of_nalgebra() {
    for v in rotation_vectors() {
        let expected = UnitQuaternion::from_scaled_axis(v.cast::<f64>());
        let turn = Quat::<f32x8>::from_rotation_vector(&Vec3::splat(&v));
        let apart = expected.angle_to(&turn.get(5).cast());
        assert!(apart < 5e-7, "{apart} from the turn by {v:?}");
        let shorter = expected.scaled_axis();
        let negative = Quat {
            w: -turn.w,
            v: -turn.v,
        };
        for back in [turn, negative].map(|turn| turn.rotation_vector().get(3)) {
            let apart = (back.cast() - shorter).norm();
            assert!(apart < 4e-6, "{back:?} is {apart} from {shorter:?}");
        }
    }
}

#[test]
fn half_a_turn_has_a_vector_of_length_pi() {
    let turn = Quat::<f32x8> {
        w: f32x8::ZERO,
        v: Vec3::splat(&Vector3::y()),
    };
    let length = turn.rotation_vector().get(0).norm();
    assert!((length - std::f32::consts::PI).abs() < 1e-6, "{length}");
}

#[test]
fn a_rotation_vector_beyond_all_bounds_still_makes_a_unit_quaternion() {
    for length in [7.0, 1e3, 1e12, 1e18] {
        let turn = Quat::<f32x8>::from_rotation_vector(&Vec3::splat(&(Vector3::x() * length)));
        let norm = (turn.w * turn.w + turn.v.dot(&turn.v)).sqrt().get(0);
        assert!((norm - 1.0).abs() < 1e-3, "{norm} at {length}");
        let turn = Quat::from_axis_angle(&Vec3::splat(&Vector3::x()), f32x8::splat(length));
        let norm = (turn.w * turn.w + turn.v.dot(&turn.v)).sqrt().get(0);
        assert!((norm - 1.0).abs() < 1e-3, "{norm} at {length}");
    }
}

#[test]
fn turns_about_an_axis_are_those_of_nalgebra_at_any_angle() {
    let axis = Vector3::new(0.48, -0.6, 0.64);
    for k in -400..400 {
        let angle = k as f32 * 0.0731;
        let turn = Quat::<f32x8>::from_axis_angle(&Vec3::splat(&axis), f32x8::splat(angle));
        let unit = nalgebra::Unit::new_normalize(axis.cast::<f64>());
        let expected = UnitQuaternion::from_axis_angle(&unit, f64::from(angle));
        let apart = expected.angle_to(&turn.get(0).cast());
        assert!(
            apart < 1e-6 * (1.0 + f64::from(angle.abs())),
            "{apart} at {angle}"
        );
    }
}

#[test]
fn a_symmetric_matrix_is_turned_and_solved_as_in_nalgebra() {
    let m = Matrix3::new(2.0, 0.3, -0.1, 0.3, 1.5, 0.2, -0.1, 0.2, 0.7);
    let lanes = Symmetric::<f32x8>::splat(&m);
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -1.0, 0.7));
    let r = turn.to_rotation_matrix().into_inner();
    let v = Vector3::new(0.5, -1.0, 2.0);
    let turned = lanes.rotated(&Quat::splat(&turn).to_matrix());
    let expected = r * m * r.transpose() * v;
    assert!((turned.times(&Vec3::splat(&v)).get(1) - expected).norm() < 1e-5);
    let solved = turned.solve(&Vec3::splat(&expected)).get(7);
    assert!((solved - v).norm() < 1e-5, "{solved:?}");
}

/// What a falling, flailing character does on one kind of lanes.
struct Fall<'a>(&'a mut Vec<LinkState>);

impl Work for Fall<'_> {
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let skeleton = Skeleton::load("humanoid").expect("the built-in humanoid loads");
        let character = Character::new(&skeleton).expect("it can be simulated");
        let (tree, settings) = (Tree::new(&character), Settings::default());
        let mut state = State::new(&tree);
        let rest = skeleton.rest_qpos();
        let mut states = character.states(&skeleton, &rest, &vec![0.3; skeleton.nv]);
        state.reset(&tree, &states);
        let mut contacts = vec![false; character.links.len()];
        let (mut workspace, mut result) = (Workspace::default(), Ok(()));
        for _ in 0..40 {
            let one = Lane {
                state: &mut state,
                links: &mut states,
                contacts: &mut contacts,
                result: &mut result,
            };
            workspace.step_on::<L>(&tree, &settings, &mut [one]);
        }
        assert!(result.is_ok() && contacts.contains(&true), "it never fell");
        *self.0 = states;
    }
}

#[test]
fn all_kinds_of_lanes_give_the_same_bits() {
    let [mut widest, mut portable] = [const { Vec::new() }; 2];
    on_widest_lanes(Fall(&mut widest));
    Fall(&mut portable).run::<f32x8>();
    assert_eq!(widest, portable);
}

#[test]
fn masks_choose_by_lane() {
    let mask = f32x8::mask(0b1010_0110);
    assert_eq!(mask.bits(), 0b1010_0110);
    let chosen = mask.select(f32x8::splat(1.0), f32x8::ZERO);
    for lane in 0..LANES {
        assert_eq!(chosen.get(lane), (0b1010_0110 >> lane & 1) as f32);
    }
}
