//! Episodes that are disturbed.

use super::*;

/// The same seed disturbs alike, another otherwise, and none at all not.
#[test]
fn disturbances_are_those_of_their_seed() {
    let (model, motion) = (Arc::new(model()), motion("walk.glb", Some(LoopMode::Wrap)));
    let reference = Arc::new(Reference::new(&motion, &model).expect("a reference"));
    let play = |perturbations: Perturbations, seed: Option<u64>| {
        let setting = ImitationSettings {
            perturbations,
            ..ImitationSettings::default()
        };
        let references = [reference.clone()].into();
        let mut env = Imitation::new(model.clone(), references, &setting, Purpose::Training);
        env.reset(0.2);
        if let Some(seed) = seed {
            env.disturb(perturbations, seed);
        }
        let action = no_action();
        for _ in 0..6 {
            step(&mut env, &action);
        }
        env.world().states().to_vec()
    };
    let shoves = Perturbations {
        push_interval_s: [0.05, 0.1],
        ..Perturbations::usual()
    };
    assert_eq!(play(shoves, Some(1)), play(shoves, Some(1)));
    assert_ne!(play(shoves, Some(1)), play(shoves, Some(2)));
    assert_ne!(play(shoves, Some(1)), play(shoves, None));
    let none = Perturbations::default();
    assert_eq!(play(none, Some(1)), play(none, None));
}

/// Who is shoved goes on from where that has brought it; before, it has to be where its reference is.
#[test]
fn after_a_shove_the_reference_is_where_the_agent_is() {
    let apart = |follow: bool, steps: usize| {
        let ranges = Perturbations {
            push_m_s: [1.0, 1.0],
            push_interval_s: [0.2, 0.2],
            follow,
            ..Perturbations::default()
        };
        let setting = ImitationSettings::default();
        let mut env = environment_of("walk.glb", Some(LoopMode::Wrap), setting);
        env.reset_at_rest();
        env.disturb(ranges, 1);
        let action = no_action();
        for _ in 0..steps {
            step(&mut env, &action);
        }
        let wanted = env.wanted();
        let place = |links: &[LinkState]| links[0].pose.translation.vector;
        place(env.world().states()) - place(&wanted.links)
    };
    // The first shove comes with the eighth step.
    let before = apart(true, 7);
    assert_eq!(before, apart(false, 7));
    assert!(before.xy().norm() > 0.05, "{before}");
    let (beside, left_behind) = (apart(true, 12), apart(false, 12));
    assert!(beside.xy().norm() < 1e-4, "{beside}");
    assert!(left_behind.xy().norm() > 0.1, "{left_behind}");
    let heights = beside.z - left_behind.z;
    assert!(heights.abs() < 1e-4, "moved along the ground alone");
}
