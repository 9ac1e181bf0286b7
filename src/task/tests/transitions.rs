//! How a motion goes over into another, and a cycle into the next.

use super::*;

/// An agent that stands in the way of its walk stays behind by most of a cycle; the next cycle begins where it is.
#[test]
fn a_cycle_that_follows_begins_where_the_agent_is() {
    let apart = |cycles_follow: bool| {
        let setting = Setting {
            cycles_follow,
            terminations: Terminations {
                distance: None,
                fall: false,
                reward: None,
            },
            ..Setting::default()
        };
        let mut env = environment_of("walk.glb", Some(LoopMode::Wrap), setting);
        env.reset_at_rest();
        let action = vec![0.0; env.action_size()];
        let mut wanted = env.blank();
        let cycle = motion("walk.glb", Some(LoopMode::Wrap)).duration();
        while env.time() < cycle {
            env.step(&action);
        }
        env.wanted(&mut wanted);
        let place = |links: &[LinkState]| links[0].pose.translation.vector.xy();
        let height = wanted.links[0].pose.translation.vector.z;
        ((place(env.states()) - place(&wanted.links)).norm(), height)
    };
    let (behind, height) = apart(false);
    let (beside, same_height) = apart(true);
    assert!(behind > 0.05, "{behind} m");
    assert!(beside < 1e-4, "{beside} m");
    assert!(
        (height - same_height).abs() < 1e-5,
        "moved along the ground alone"
    );
}

#[test]
fn a_motion_is_nearest_to_itself_wherever_it_goes_on() {
    let stage = stage();
    let reference = Reference::new(&motion("walk.glb", Some(LoopMode::Wrap)), &stage);
    let reference = reference.expect("a reference");
    let mut sample = reference.blank();
    let turned = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 2.0);
    let place = Placement {
        pose: Isometry3::from_parts(Vector3::new(3.0, -1.0, 0.0).into(), turned),
        velocity: Vector3::zeros(),
    };
    for time in [0.1, 0.55, 0.9] {
        reference.sample_at(&place, 3.0 * reference.duration() + time, &mut sample);
        let nearest = reference.nearest(&sample);
        assert!((nearest - time).abs() < 0.01, "{nearest}, not {time}");
    }
}

/// From the walk into the kick: the kick begins where the walk has led, the character goes on as it is, and time counts
/// from the start of the episode.
#[test]
fn another_motion_begins_where_the_one_before_has_led() {
    let mut env = environment("walk.glb", Some(LoopMode::Wrap), 4.0);
    env.reset(0.3);
    let action = vec![0.0; env.action_size()];
    for _ in 0..30 {
        env.step(&action);
    }
    let mut before = env.blank();
    env.wanted(&mut before);
    let states = env.states().to_vec();
    let kick = motion("kick.fbx", Some(LoopMode::Clamp));
    let kick = Arc::new(Reference::new(&kick, &stage()).expect("a reference"));
    env.change_to(&kick);
    assert_eq!(env.states(), states);
    let mut after = env.blank();
    env.wanted(&mut after);
    let root = |sample: &Sample| {
        let pose = sample.links[0].pose;
        (pose.translation.vector.xy(), pose.rotation * Vector3::x())
    };
    let ((at, ahead), (then, facing)) = (root(&before), root(&after));
    assert!((at - then).norm() < 1e-4);
    assert!(ahead.xy().normalize().dot(&facing.xy().normalize()) > 1.0 - 1e-5);
    // It begins at the speed of the walk, and after a second has its own.
    let speed = |sample: &Sample| sample.dynamics.com_velocity.xy();
    assert!((speed(&after) - speed(&before)).norm() < 1e-4);
    assert!(speed(&before).norm() > 0.8);
    assert!((env.elapsed() - 1.0).abs() < 1e-6);
    let left = (kick.duration() - env.time()).min(3.0);
    assert!((env.possible_steps() - (30.0 * left).ceil()).abs() <= 1.0);
    let begun = env.time();
    while env.time() < begun + 1.0 {
        env.step(&action);
    }
    let mut alone = env.blank();
    kick.sample(env.time(), &mut alone);
    env.wanted(&mut after);
    let turn = root(&after)
        .1
        .xy()
        .normalize()
        .dot(&root(&alone).1.xy().normalize());
    assert!(
        (speed(&after).norm() - speed(&alone).norm()).abs() < 1e-4,
        "{turn}"
    );
}
