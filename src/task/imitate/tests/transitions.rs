//! How a motion goes over into another, and a cycle into the next.

use super::*;
use crate::task::imitate::blend::Blend;
use crate::task::imitate::transition::Transition;

/// An agent that stands in the way of its walk stays behind by most of a cycle; the next cycle begins where it is.
#[test]
fn a_cycle_that_follows_begins_where_the_agent_is() {
    let apart = |cycles_follow: bool| {
        let setting = ImitationSettings {
            cycles_follow,
            terminations: Terminations {
                distance: None,
                fall: false,
                reward: None,
            },
            ..ImitationSettings::default()
        };
        let mut env = environment_of("walk.glb", Some(LoopMode::Wrap), setting);
        env.reset_at_rest();
        let action = no_action();
        let cycle = motion("walk.glb", Some(LoopMode::Wrap)).duration();
        while env.moment().time < cycle {
            step(&mut env, &action);
        }
        let wanted = env.wanted();
        let place = |links: &[LinkState]| links[0].pose.translation.vector.xy();
        let height = wanted.links[0].pose.translation.vector.z;
        (
            (place(env.world().states()) - place(&wanted.links)).norm(),
            height,
        )
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
    let model = model();
    let reference = Reference::new(&motion("walk.glb", Some(LoopMode::Wrap)), &model);
    let reference = reference.expect("a reference");
    let mut sample = reference.blank();
    let turned = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 2.0);
    let place = Placement {
        pose: Isometry3::from_parts(Vector3::new(3.0, -1.0, 0.0).into(), turned),
        velocity: Vector3::zeros(),
        pace: 1.0,
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
    let action = no_action();
    for _ in 0..30 {
        step(&mut env, &action);
    }
    let before = env.wanted();
    let states = env.world().states().to_vec();
    let kick = motion("kick.fbx", Some(LoopMode::Clamp));
    let kick = Arc::new(Reference::new(&kick, &model()).expect("a reference"));
    env.change_to(&kick);
    assert_eq!(env.world().states(), states);
    let mut after = env.wanted();
    let root = |sample: &ReferenceState| {
        let pose = sample.links[0].pose;
        (pose.translation.vector.xy(), pose.rotation * Vector3::x())
    };
    // In the same pose and at the same speed, to begin with.
    for (a, b) in before.links.iter().zip(&after.links) {
        assert!((a.pose.translation.vector - b.pose.translation.vector).norm() < 1e-4);
        assert!(a.pose.rotation.angle_to(&b.pose.rotation) < 1e-3);
        assert!((a.linear - b.linear).norm() < 1e-3);
        assert!((a.angular - b.angular).norm() < 1e-2);
    }
    let ((at, ahead), (then, facing)) = (root(&before), root(&after));
    assert!((at - then).norm() < 1e-4);
    assert!(ahead.xy().normalize().dot(&facing.xy().normalize()) > 1.0 - 1e-5);
    // It begins at the speed of the walk, and after a second has its own.
    let speed = |sample: &ReferenceState| sample.dynamics.com_velocity.xy();
    assert!((speed(&after) - speed(&before)).norm() < 1e-4);
    assert!(speed(&before).norm() > 0.8);
    assert!((env.elapsed_s() - 1.0).abs() < 1e-6);
    let left = (kick.duration() - env.moment().time).min(3.0);
    assert!((env.possible_steps() - (30.0 * left).ceil()).abs() <= 1.0);
    let begun = env.elapsed_s();
    while env.elapsed_s() < begun + 1.0 {
        step(&mut env, &action);
    }
    let mut alone = env.wanted();
    kick.sample(env.moment().time, &mut alone);
    after = env.wanted();
    let turn = root(&after)
        .1
        .xy()
        .normalize()
        .dot(&root(&alone).1.xy().normalize());
    assert!(
        (speed(&after).norm() - speed(&alone).norm()).abs() < 1e-4,
        "{turn}"
    );
    // It is where the agent is, and stays there.
    for _ in 0..12 {
        step(&mut env, &action);
        after = env.wanted();
        let at = env.world().states()[0].pose.translation.vector.xy();
        assert!((root(&after).0 - at).norm() < 1e-4);
    }
}

/// A walk at half its speed goes over into itself as it is: that begins at half its pace, so nothing slides, gathers speed within
/// a second, and always moves as it says.
#[test]
fn a_faster_motion_begins_at_the_pace_of_the_slower_one() {
    let model = model();
    let walk = motion("walk.glb", Some(LoopMode::Wrap));
    let mut slow = walk.clone();
    slow.fps /= 2.0;
    slow.qvel.iter_mut().flatten().for_each(|v| *v /= 2.0);
    let [slow, fast] = [slow, walk].map(|m| Reference::new(&m, &model).expect("a reference"));
    let (mut present, mut begun) = (slow.blank(), fast.blank());
    slow.sample(0.8, &mut present);
    fast.sample(0.4, &mut begun);
    let transition = Transition::between(&model.character, &present, &begun, 0.4);
    let begins = transition.at(0.0);
    assert!((begins.pace - 0.5).abs() < 1e-3, "{}", begins.pace);
    assert!(begins.velocity.norm() < 5e-4, "{}", begins.velocity);
    let led = |passed: f64| {
        let mut sample = fast.blank();
        fast.sample_at(
            &transition.at(passed),
            transition.clock().time(passed),
            &mut sample,
        );
        sample
    };
    let alone = |time: f64| {
        let mut sample = fast.blank();
        fast.sample(time, &mut sample);
        sample
    };
    // By how much velocities aren't those of the places: a clip's own are those of its frames.
    let amiss = |[before, now, after]: [ReferenceState; 3], span: f64, i: usize| {
        let [a, b] = [&before, &after].map(|sample| sample.links[i].pose.translation.vector);
        ((b - a) / span as f32 - now.links[i].linear).norm()
    };
    let step = 0.004;
    for tenth in 1..12 {
        let passed = 0.1 * f64::from(tenth);
        let times = [-step, 0.0, step].map(|by| passed + by);
        let [first, time, last] = times.map(|passed| transition.clock().time(passed));
        let pace = transition.at(passed).pace;
        for i in 0..model.character.links.len() {
            let own = amiss([first, time, last].map(alone), last - first, i);
            let found = amiss(times.map(led), 2.0 * step, i);
            assert!(
                (found - pace * own).abs() < 0.01,
                "{found}, {own} of {i} at {passed}"
            );
        }
        let speed = led(passed).dynamics.com_velocity.norm();
        let own = alone(time).dynamics.com_velocity.norm();
        let left = (1.0 - passed).max(0.0).powi(2);
        let expected = own * (1.0 - 0.5 * left as f32);
        assert!(
            (speed - expected).abs() < 0.005,
            "{speed} m/s, not {expected}"
        );
    }
    assert_eq!(transition.at(1.0).pace, 1.0);
    let gained = transition.clock().time(1.0) - 0.4;
    assert!((gained - (1.0 - 0.5 / 3.0)).abs() < 1e-6, "{gained} s");
}

/// While a pose that stands still takes over from the midst of a kick, places and velocities belong together, limbs keep
/// their length, and in the end the new pose is all there is.
#[test]
fn a_blend_moves_as_it_says() {
    let model = model();
    let present = sample(0.6);
    let mut still = sample(0.0).links;
    for link in &mut still {
        (link.linear, link.angular) = (Vector3::zeros(), Vector3::zeros());
    }
    let blend = Blend::between(&model.character, &present.links, &still);
    let at = |seconds: f64| {
        let mut links = still.clone();
        blend.apply(&model.character, seconds, &mut links);
        links
    };
    let step = 0.002;
    let mut fastest: f32 = 0.0;
    for part in 1..20 {
        let seconds = 0.02 * f64::from(part);
        let (before, now, after) = (at(seconds - step), at(seconds), at(seconds + step));
        for i in 0..now.len() {
            let [a, b] = [&before[i].pose, &after[i].pose];
            let span = 2.0 * step as f32;
            let linear = (b.translation.vector - a.translation.vector) / span;
            let angular = (b.rotation * a.rotation.inverse()).scaled_axis() / span;
            assert!(
                (linear - now[i].linear).norm() < 0.02,
                "{i}: {linear} at {seconds}"
            );
            assert!(
                (angular - now[i].angular).norm() < 0.05,
                "{i}: {angular} at {seconds}"
            );
            fastest = fastest.max(angular.norm());
            if let Some(p) = model.character.links[i].parent {
                let length = |links: &[LinkState]| {
                    let [a, b] = [p, i].map(|i| links[i].pose.translation.vector);
                    (a - b).norm()
                };
                let anchored = model.character.links[i].anchor.norm() > 0.0;
                assert!(anchored || (length(&now) - length(&still)).abs() < 1e-4);
            }
        }
    }
    assert!(fastest > 2.0, "the kick is fast: {fastest} rad/s");
    assert!(!blend.lasts(0.4));
    for (a, b) in at(0.4).iter().zip(&still) {
        assert!((a.pose.translation.vector - b.pose.translation.vector).norm() < 1e-5);
        assert!(a.linear.norm() < 1e-4 && a.angular.norm() < 1e-4);
    }
}

/// Told to go over at any moment, it does so where the two motions are alike: never farther apart than at that moment.
#[test]
fn a_motion_is_left_where_the_next_one_is_near() {
    let walk = motion("walk.glb", Some(LoopMode::Wrap));
    let kick = motion("kick.fbx", Some(LoopMode::Clamp));
    let kick = Arc::new(Reference::new(&kick, &model()).expect("a reference"));
    let walk = Reference::new(&walk, &model()).expect("a reference");
    let mut waited = 0;
    for start in 0..8 {
        let mut env = environment("walk.glb", Some(LoopMode::Wrap), 20.0);
        let told = 0.13 * f64::from(start);
        env.reset(told);
        env.lead_to(&kick);
        let action = no_action();
        let mut steps = 0_u32;
        while env.is_changing() {
            let slowed = f64::from(steps) / 30.0;
            let behind = told + slowed - env.moment().time;
            // The kick begins standing, so the walk comes to half its pace within a second.
            assert!((behind - slowed * slowed / 4.0).abs() < 1e-6, "{behind}");
            step(&mut env, &action);
            steps += 1;
        }
        assert!(steps <= 30, "{steps} steps");
        waited += steps;
        // The walk slows down meanwhile.
        let mut slowing = Transition::none(told);
        let mut sample = walk.blank();
        walk.sample(told, &mut sample);
        let speed = sample.dynamics.com_velocity.xy().norm();
        slowing.slow(0.0, speed, 0.0);
        let mut far = |steps: u32| {
            let passed = f64::from(steps) / 30.0;
            let place = slowing.at(passed);
            walk.sample_at(&place, slowing.clock().time(passed), &mut sample);
            kick.distance(&sample)
        };
        assert!(far(steps) <= far(0) + 1e-6);
    }
    assert!(waited > 0);
}

/// Whoever stands up from a crawl has its knees on the ground while the poses blend.
#[test]
fn what_was_on_the_ground_may_touch_it_in_a_transition() {
    let (mut present, begun) = (sample(0.4), sample(0.0));
    let knee = present.may_touch.iter().position(|may| !may);
    let knee = knee.expect("a body that the kick keeps off the ground");
    present.may_touch[knee] = true;
    let transition = Transition::between(&model().character, &present, &begun, 0.0);
    let mut allowed = begun.may_touch.clone();
    assert!(!allowed[knee]);
    transition.allow(&mut allowed);
    assert!(allowed[knee]);
    // A motion that wasn't entered from another allows nothing else.
    let mut allowed = begun.may_touch.clone();
    Transition::none(0.0).allow(&mut allowed);
    assert_eq!(allowed, begun.may_touch);
}
