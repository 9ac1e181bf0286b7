//! Reward terms against their formulas.

use super::{model, sample};
use crate::sim::LinkState;
use crate::skeleton::Skeleton;
use crate::task::dynamics::Masses;
use crate::task::follow::terms;
use crate::task::{CharacterModel, ImitationSettings, Kernels, Rewards, TERM_NAMES, Terms};
use nalgebra::{UnitQuaternion, Vector3};

fn close(found: f32, expected: f64, what: &str) {
    assert!(
        (f64::from(found) - expected).abs() < 1e-4,
        "{what}: {found}, not {expected}"
    );
}

/// Terms of an agent that differs from its reference by `change`.
fn changed(change: impl Fn(&mut Vec<LinkState>)) -> Terms {
    compared(Kernels::Tracking, change)
}

fn compared(kernels: Kernels, change: impl Fn(&mut Vec<LinkState>)) -> Terms {
    let (model, sample) = (model(), sample(0.4));
    let masses = Masses::new(&model.character);
    let mut agent = sample.links.clone();
    change(&mut agent);
    let dynamics = masses.dynamics(&agent);
    terms(
        kernels,
        &model,
        (&agent, &dynamics),
        (&sample.links, &sample.dynamics),
    )
}

#[test]
fn a_perfect_agent_earns_everything() {
    let terms = changed(|_| ());
    for (name, value) in TERM_NAMES.iter().zip(terms.values()).take(7) {
        close(value, 1.0, name);
    }
    close(terms.total(Rewards::default().weights()), 1.0, "the reward");
}

#[test]
fn kernels_have_their_terms_and_no_others() {
    for kernels in [
        Kernels::Tracking,
        Kernels::Deepmimic,
        Kernels::DeepmimicProgram,
        Kernels::Booth2020,
    ] {
        let terms = compared(kernels, |_| ());
        for ((name, value), has) in TERM_NAMES.iter().zip(terms.values()).zip(kernels.has()) {
            close(
                value,
                f64::from(u8::from(has)),
                &format!("{kernels} {name}"),
            );
        }
    }
    let wrong = ImitationSettings {
        rewards: Rewards {
            kernels: Kernels::Deepmimic,
            ..Rewards::default()
        },
        ..ImitationSettings::default()
    };
    let said = wrong.check().map_err(|e| e.to_string());
    assert!(said.is_err_and(|said| said.contains("`position`") && said.contains("deepmimic")));
}

/// DeepMimic, section 5.1: four end effectors and one centre of mass moved by d.
#[test]
fn a_shift_costs_ends_and_centre_as_published() {
    let shift = Vector3::new(0.05, -0.1, 0.02);
    let moved = |links: &mut Vec<LinkState>| {
        for link in links.iter_mut() {
            link.pose.translation.vector += shift;
        }
    };
    let d = f64::from(shift.norm_squared());
    let terms = compared(Kernels::Deepmimic, moved);
    close(terms.end_effector, (-40.0 * 4.0 * d).exp(), "ends");
    close(terms.com_position, (-10.0 * d).exp(), "centre");
    close(terms.pose * terms.velocity, 1.0, "the rest");
    // The program of the second: hands, feet and chest.
    let terms = compared(Kernels::Booth2020, moved);
    close(terms.end_effector, (-5.0 * d).exp(), "ends");
    close(terms.com_position, (-d / 0.3).exp(), "centre");
}

/// The program: the root's place and what is high count, ends as seen from the root don't, but for their height.
#[test]
fn a_shift_costs_the_root_and_heights_in_the_program() {
    let shift = Vector3::new(0.05, -0.1, 0.02);
    let terms = compared(Kernels::DeepmimicProgram, |links| {
        for link in links.iter_mut() {
            link.pose.translation.vector += shift;
        }
    });
    let d = f64::from(shift.norm_squared());
    close(terms.root, (-5.0 * d).exp(), "root");
    close(terms.end_effector, (-40.0_f64 * 0.02 * 0.02).exp(), "ends");
    close(terms.pose * terms.velocity * terms.com, 1.0, "the rest");
    let weights: f32 = model().joint_weights.iter().sum();
    close(weights, 1.0, "all joints");
    // A hip of three motors counts with each of them.
    let robot = Skeleton::load("robot").expect("a built-in character");
    let robot = CharacterModel::new(robot).expect("it can be simulated");
    let weighs = |name: &str| {
        let link = robot.character.links.iter().position(|l| l.name == name);
        robot.joint_weights[link.expect("a link of that name")]
    };
    let thigh = weighs("left_thigh");
    assert!(thigh > 0.05, "{thigh}");
    assert_eq!(weighs("left_hip_pitch_link"), thigh);
    assert_eq!(weighs("left_hip_roll_link"), thigh);
}

/// A head turned by θ and turning at ω: one joint of the sums.
#[test]
fn a_turned_head_costs_by_the_sum_over_joints() {
    let model = model();
    let head = model.character.links.iter().position(|l| l.name == "head");
    let head = head.expect("a head");
    let turned = |links: &mut Vec<LinkState>| {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, 0.0, 0.4));
        links[head].pose.rotation *= turn;
    };
    let turning = |links: &mut Vec<LinkState>| links[head].angular += Vector3::new(0.0, 2.0, 0.0);
    let terms = compared(Kernels::Deepmimic, turned);
    close(terms.pose, (-2.0_f64 * 0.25).exp(), "pose");
    let terms = compared(Kernels::Deepmimic, turning);
    close(terms.velocity, (-0.1_f64 * 4.0).exp(), "velocity");
    // Of 1 root, 1.5 of trunk and hips, 1.5 of neck, knees and shoulders, 0.8 of ankles and elbows.
    let share = 0.3 / 4.8;
    let terms = compared(Kernels::DeepmimicProgram, turned);
    close(terms.pose, (-2.0 * share * 0.25_f64).exp(), "pose");
    let terms = compared(Kernels::DeepmimicProgram, turning);
    close(terms.velocity, (-0.1 * share * 4.0_f64).exp(), "velocity");
    let terms = compared(Kernels::Booth2020, turned);
    close(terms.pose, (-0.25_f64 / 16.0).exp(), "pose");
    let terms = compared(Kernels::Booth2020, turning);
    close(terms.velocity, (-4.0_f64 / 7000.0).exp(), "velocity");
}

/// All bodies faster by v: momentum about the centre of mass doesn't change, its velocity does, and so do the ends'.
#[test]
fn a_drift_costs_centre_and_ends_as_published() {
    let drift = Vector3::new(0.6, 0.0, -0.8);
    let terms = compared(Kernels::Booth2020, |links| {
        for link in links.iter_mut() {
            link.linear += drift;
        }
    });
    close(terms.com, (-1.0_f64 / 6.0).exp(), "centre");
    close(
        terms.end_effector_velocity,
        (-5.0_f64 / 170.0).exp(),
        "ends",
    );
    close(terms.angular_momentum, 1.0, "angular momentum");
}

/// The head alone spins faster by ω: the angular momentum about the centre differs by I·ω, and by what its mass, off
/// the joint, adds: m (c − C) × (ω × r).
#[test]
fn a_spinning_head_costs_its_angular_momentum() {
    let model = model();
    let head = model.character.links.iter().position(|l| l.name == "head");
    let head = head.expect("a head");
    let spin = Vector3::new(3.0, 0.0, 0.0);
    let terms = compared(Kernels::Booth2020, |links| links[head].angular += spin);
    let (link, sample) = (&model.character.links[head], sample(0.4));
    let pose = &sample.links[head].pose;
    let arm = pose.rotation * link.com.cast::<f32>();
    let v = spin.cross(&arm);
    let turn = pose.rotation.to_rotation_matrix();
    let own = turn.matrix() * link.inertia.cast::<f32>() * turn.matrix().transpose() * spin;
    let center = pose.translation.vector + arm;
    let change = own + (center - sample.dynamics.com).cross(&v) * link.mass as f32;
    let expected = (-f64::from(change.norm_squared()) / 150.0).exp();
    assert!(expected < 0.999, "it has to show");
    close(terms.angular_momentum, expected, "angular momentum");
}

#[test]
fn a_shift_costs_the_root_term_alone() {
    let shift = Vector3::new(0.1, -0.2, 0.05);
    let terms = changed(|links| {
        for link in links.iter_mut() {
            link.pose.translation.vector += shift;
        }
    });
    close(
        terms.root,
        (-10.0 * f64::from(shift.norm_squared())).exp(),
        "root",
    );
    for (name, value) in TERM_NAMES.iter().zip(terms.values()).take(7) {
        if *name != "root" {
            close(value, 1.0, name);
        }
    }
}

#[test]
fn a_drift_costs_the_velocities_of_root_and_centre() {
    let drift = Vector3::new(0.3, 0.0, -0.4);
    let terms = changed(|links| {
        for link in links.iter_mut() {
            link.linear += drift;
        }
    });
    close(terms.root_velocity, (-0.25_f64).exp(), "root velocity");
    close(terms.com, (-0.5_f64).exp(), "centre of mass");
    close(terms.angular_momentum, 1.0, "angular momentum");
    close(
        terms.pose * terms.position * terms.velocity,
        1.0,
        "the rest",
    );
}

#[test]
fn a_turned_head_costs_by_the_mean_over_joints() {
    let model = model();
    let head = |l: &crate::sim::Link| l.name == "head";
    let head = model.character.links.iter().position(head).expect("a head");
    let terms = changed(|links| {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, 0.0, 0.4));
        links[head].pose.rotation *= turn;
        links[head].angular += Vector3::new(0.0, 2.0, 0.0);
    });
    let joints = (model.character.links.len() - 1) as f64;
    close(terms.pose, (-6.0 * 0.25 / joints).exp(), "pose");
    close(terms.velocity, (-0.1 * 4.0 / joints).exp(), "velocity");
    close(terms.root * terms.position, 1.0, "root and position");
}
