//! Episodes that are disturbed.

use super::*;

/// The same seed disturbs alike, another otherwise, and none at all not.
#[test]
fn disturbances_are_those_of_their_seed() {
    let (stage, motion) = (Arc::new(stage()), motion("walk.glb", Some(LoopMode::Wrap)));
    let reference = Arc::new(Reference::new(&motion, &stage).expect("a reference"));
    let play = |perturbations: Perturbations, seed: Option<u64>| {
        let setting = Setting {
            perturbations,
            ..Setting::default()
        };
        let mut env = Imitate::new(stage.clone(), reference.clone(), &setting);
        env.reset(0.2);
        if let Some(seed) = seed {
            env.perturb(seed);
        }
        let action = vec![0.0; env.action_size()];
        for _ in 0..6 {
            env.step(&action);
        }
        env.states().to_vec()
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
        let setting = Setting {
            perturbations: Perturbations {
                push_m_s: [1.0, 1.0],
                push_interval_s: [0.2, 0.2],
                follow,
                ..Perturbations::default()
            },
            ..Setting::default()
        };
        let mut env = environment_of("walk.glb", Some(LoopMode::Wrap), setting);
        env.reset_at_rest();
        env.perturb(1);
        let action = vec![0.0; env.action_size()];
        for _ in 0..steps {
            env.step(&action);
        }
        let mut wanted = env.blank();
        env.wanted(&mut wanted);
        let place = |links: &[LinkState]| links[0].pose.translation.vector;
        place(env.states()) - place(&wanted.links)
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
