//! Drives, ranges and what turns about what.

use super::*;

on_both_engines!(
    a_ball_drive_reaches_a_large_rotation,
    a_hinge_stops_at_the_end_of_its_range,
    a_joint_without_a_drive_swings_freely,
    two_hinges_of_one_body_follow_a_moving_target_together,
);

fn a_ball_drive_reaches_a_large_rotation(settings: Settings) {
    let character = humanoid();
    let mut world = World::new(&character, settings);
    world.reset(&standing(&character, 100.0));
    let shoulder = character
        .links
        .iter()
        .position(|l| l.name == "left_upper_arm")
        .expect("a humanoid has arms");
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.9, -2.2, 0.6));
    let mut targets = held(&character);
    targets[shoulder] = Target::Ball(turn);
    world.set_targets(&targets);
    for _ in 0..60 {
        world.step().expect("flight stays finite");
    }
    let parent = character.links[shoulder]
        .parent
        .expect("an arm has a parent");
    let (a, b) = (
        world.states()[parent].pose.rotation,
        world.states()[shoulder].pose.rotation,
    );
    let reached = character.joint_rotation(shoulder, a, b);
    assert!(
        reached.angle_to(&turn) < 0.02,
        "off by {} rad",
        reached.angle_to(&turn)
    );
}

/// A trunk with one limb, whose joints are `joints`, and `actuators` on them.
fn jointed(joints: &str, actuators: &str) -> Character {
    let text = format!(
        r#"<mujoco><compiler angle="radian"/><worldbody><body name="trunk"><freejoint/>
        <geom type="sphere" size="0.3" mass="20"/>
        <body name="limb" pos="0 0 -0.3">{joints}
        <geom type="capsule" fromto="0 0 0 0 0 -0.4" size="0.05" mass="3"/></body></body></worldbody>
        <actuator>{actuators}</actuator></mujoco>"#
    );
    let skeleton = Skeleton::from_mjcf("jointed", &text, None).expect("the text is MJCF");
    Character::new(&skeleton).expect("it can be simulated")
}

/// Rotation of the limb in the trunk after `steps` in flight, starting at rest or with the limb turning at `spin`.
fn limb_after(
    settings: Settings,
    character: &Character,
    spin: Vector3<f32>,
    steps: usize,
    target: impl Fn(usize) -> Target,
) -> UnitQuaternion<f32> {
    let mut world = World::new(character, settings);
    let mut states = standing(character, 50.0);
    states[1].angular = spin;
    world.reset(&states);
    for step in 0..steps {
        world.set_targets(&[Target::Free, target(step)]);
        world.step().expect("flight stays finite");
    }
    let [trunk, limb] = [0, 1].map(|i: usize| world.states()[i].pose.rotation);
    trunk.inverse() * limb
}

fn a_hinge_stops_at_the_end_of_its_range(settings: Settings) {
    let character = jointed(
        r#"<joint name="knee" type="hinge" axis="0 1 0" range="0 2"/>"#,
        r#"<position joint="knee" kp="300" kv="30"/>"#,
    );
    for (target, end) in [(-1.5, 0.0), (3.0, 2.0)] {
        let turn = limb_after(settings, &character, Vector3::zeros(), 60, |_| {
            Target::Hinge(target)
        });
        let angle = turn.scaled_axis().y;
        assert!((angle - end).abs() < 0.03, "at {angle}, not {end}");
    }
}

fn a_joint_without_a_drive_swings_freely(settings: Settings) {
    let character = jointed(r#"<joint type="hinge" axis="0 1 0"/>"#, "");
    let spin = Vector3::new(0.0, 3.0, 0.0);
    let turn = limb_after(settings, &character, spin, 15, |_| Target::Hinge(0.0));
    assert!(turn.angle() > 1.0, "turned by {} rad only", turn.angle());
}

fn two_hinges_of_one_body_follow_a_moving_target_together(settings: Settings) {
    let character = jointed(
        r#"<joint name="a" type="hinge" axis="0 1 0"/><joint name="b" type="hinge" axis="0 0 1"/>"#,
        r#"<position joint="a" kp="300" kv="30"/><position joint="b" kp="300" kv="30"/>"#,
    );
    assert_eq!(character.dof, 2);
    let at = |step: usize| {
        let share = (step as f32 / 30.0).min(1.0);
        UnitQuaternion::from_scaled_axis(Vector3::y() * 0.9 * share)
            * UnitQuaternion::from_scaled_axis(Vector3::z() * -0.7 * share)
    };
    let turn = limb_after(settings, &character, Vector3::zeros(), 75, |step| {
        Target::Ball(at(step))
    });
    assert!(
        turn.angle_to(&at(75)) < 0.02,
        "off by {}",
        turn.angle_to(&at(75))
    );
}
