//! Plans to start from, by name. [`Plan::default`] is ours; the others follow a publication, and say where they don't.

use super::plan::Plan;
use crate::learn::{Activation, PpoConfig};
use crate::sim::Settings;
use crate::task::{
    Actions, ImitationSettings, Kernels, Observations, Perturbations, Rewards, Terminations,
};

/// A plan with a name.
#[derive(Clone, Copy, Debug)]
pub struct Preset {
    /// Its name on the command line.
    pub name: &'static str,
    /// What it is, in a line.
    pub about: &'static str,
    /// The character that it is meant for.
    pub skeleton: &'static str,
    /// Makes the plan.
    pub plan: fn() -> Plan,
}

/// All presets, ours first.
pub const PRESETS: [Preset; 4] = [
    Preset {
        name: "default",
        about: "ours: rotations added to the reference's, learned in minutes",
        skeleton: "humanoid",
        plan: Plan::default,
    },
    Preset {
        name: "deepmimic",
        about: "the reward and rates of the program of Peng et al. 2018, learned as in ours",
        skeleton: "humanoid",
        plan: deepmimic,
    },
    Preset {
        name: "deepmimic2018",
        about: "the paper of Peng et al. 2018 with its learner too: absolute targets, 227 observations, a network of 1024 and 512",
        skeleton: "humanoid",
        plan: deepmimic2018,
    },
    Preset {
        name: "booth2020",
        about: "Booth & Ivanov 2020: 258 observations, 21 targets, angular momentum, starts at the first frame alone",
        skeleton: "marathon",
        plan: booth2020,
    },
];

/// The preset of that name.
pub fn preset(name: &str) -> Option<&'static Preset> {
    PRESETS.iter().find(|preset| preset.name == name)
}

/// A preset names the terms that its publication has; all others are off.
const NO_WEIGHTS: Rewards = Rewards {
    kernels: Kernels::Tracking,
    pose: 0.0,
    velocity: 0.0,
    position: 0.0,
    root: 0.0,
    root_velocity: 0.0,
    com: 0.0,
    angular_momentum: 0.0,
    end_effector: 0.0,
    end_effector_velocity: 0.0,
    com_position: 0.0,
};

/// The task of Peng et al. 2018, "DeepMimic: example-guided deep reinforcement learning of physics-based character skills", as
/// its published program has it.
fn deepmimic_task() -> ImitationSettings {
    ImitationSettings {
        // 30 Hz as published; our drives are stable at 240 Hz, theirs needed 1200.
        physics: Settings::default(),
        // The authors' program; its paper has other terms (see below).
        rewards: Rewards {
            kernels: Kernels::DeepmimicProgram,
            pose: 0.5,
            velocity: 0.05,
            end_effector: 0.15,
            root: 0.2,
            com: 0.1,
            ..NO_WEIGHTS
        },
        terminations: Terminations {
            distance: None,
            fall: true,
            reward: None,
        },
        adaptive_starts: 0.0,
        // As in the authors' program.
        cycles_follow: true,
        episode_s: 20.0,
        ..ImitationSettings::default()
    }
}

/// The same, learned our way.
fn deepmimic() -> Plan {
    Plan {
        task: deepmimic_task().into(),
        samples: 6_000_000,
        // Such kernels reward the last millimetres, which noise hides; `docs/notebook/deepmimic-reward.md` compares it with 0.4.
        final_std: 0.15,
        ..Plan::default()
    }
}

/// The paper itself: its reward, and its actions, observation and learner, sections 4 to 7.
fn deepmimic2018() -> Plan {
    let base = deepmimic();
    Plan {
        task: ImitationSettings {
            // Exponential maps, zero at rest.
            actions: Actions::FromRest { reach: 1.0 },
            observations: Observations::Deepmimic,
            // Section 5.1.
            rewards: Rewards {
                kernels: Kernels::Deepmimic,
                pose: 0.65,
                velocity: 0.1,
                end_effector: 0.15,
                com_position: 0.1,
                ..NO_WEIGHTS
            },
            ..deepmimic_task()
        }
        .into(),
        // Section 6; noise and rates as in the authors' program, for they go together: a policy's gradient grows as its
        // noise shrinks. It doesn't clip gradients.
        ppo: PpoConfig {
            gamma: 0.95,
            lambda: 0.95,
            clip: 0.2,
            epochs: 1,
            minibatch: 256,
            learning_rate: 2e-6,
            critic_learning_rate: Some(5e-4),
            momentum: Some(0.9),
            advantage_limit: Some(4.0),
            max_gradient_norm: 1e6,
            target_kl: None,
            action_bound: 2.0,
            action_bound_coefficient: 10.0,
            initial_std: 0.05,
            learn_std: false,
            ..PpoConfig::default()
        },
        hidden: vec![1024, 512],
        // 64 × 64 samples: their batch of 4096.
        environments: 64,
        horizon: 64,
        samples: 60_000_000,
        final_std: 1.0,
        final_learning_rate: 1.0,
        ..base
    }
}

/// Booth & Ivanov 2020, "Realistic Physics Based Character Controller"; where the paper is silent, as its published
/// program (marathon-envs, StyleTransfer002) has it.
fn booth2020() -> Plan {
    Plan {
        task: ImitationSettings {
            // 40 Hz control on 200 Hz physics.
            physics: Settings {
                control_hz: 40.0,
                steps_per_control: 5,
                substeps: 1,
                ..Settings::default()
            },
            // "The actions are used as target rotation for the joints."
            actions: Actions::FromRest { reach: 1.0 },
            observations: Observations::Booth2020,
            rewards: Rewards {
                kernels: Kernels::Booth2020,
                pose: 0.35,
                velocity: 0.1,
                com: 0.1,
                angular_momentum: 0.15,
                end_effector: 0.15,
                end_effector_velocity: 0.1,
                com_position: 0.05,
                ..NO_WEIGHTS
            },
            // The paper has one threshold for each clip and names none; the program has this one.
            terminations: Terminations {
                distance: None,
                fall: true,
                reward: Some(0.5),
            },
            // "We can do without it."
            perturbations: Perturbations::default(),
            start_anywhere: false,
            adaptive_starts: 0.0,
            transitions_s: None,
            cycles_follow: false,
            episode_s: 25.0,
        }
        .into(),
        ppo: PpoConfig {
            gamma: 0.99,
            lambda: 0.95,
            clip: 0.2,
            epochs: 3,
            minibatch: 768,
            entropy_coefficient: 1e-5,
            learning_rate: 1e-4,
            critic_learning_rate: None,
            target_kl: None,
            // Their noise of 1 on actions that are divided by 3.
            initial_std: 1.0 / 3.0,
            learn_std: true,
            ..PpoConfig::default()
        },
        hidden: vec![256, 256],
        // Their swish has no counterpart here; this is the nearest smooth one.
        activation: Activation::Elu,
        // 256 × 84 samples: their buffer of 21504.
        environments: 256,
        horizon: 84,
        // 1008 control steps: an episode of full length fits.
        round: 12,
        samples: 128_000_000,
        final_std: 1.0,
        final_learning_rate: 0.0,
        ..Plan::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::Motion;
    use crate::skeleton::Skeleton;
    use crate::task::{CharacterModel, size};
    use crate::{import, retarget};
    use std::sync::Arc;

    #[test]
    fn presets_can_be_trained_and_survive_a_file() {
        for preset in PRESETS {
            let plan = (preset.plan)();
            plan.task.check().expect("a task");
            plan.ppo.check().expect("a learner");
            let text = serde_json::to_string(&plan).expect("a plan can be written");
            assert_eq!(serde_json::from_str::<Plan>(&text).ok(), Some(plan));
        }
    }

    /// Our own kick, which puts both feet on the ground.
    fn motion(skeleton: &Skeleton) -> Motion {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/clips/kick.fbx");
        let clip = import::load(file, &import::Options::default()).expect("our own clip reads");
        let options = retarget::Options::default();
        let retargeted = retarget::retarget(&clip, skeleton, &options);
        retargeted.expect("our own clip retargets").motion
    }

    /// The sizes that the publications give.
    #[test]
    fn observations_and_actions_have_the_published_sizes() {
        for (name, observation, action) in [("deepmimic2018", 227, 28), ("booth2020", 258, 21)] {
            let preset = preset(name).expect("a preset");
            let skeleton = Skeleton::load(preset.skeleton).expect("a built-in character");
            let motion = motion(&skeleton);
            let model = Arc::new(CharacterModel::new(skeleton).expect("it can be simulated"));
            let task = (preset.plan)()
                .task
                .build(model, &[motion])
                .expect("a task");
            assert_eq!(size(task.observation()), observation, "{name}");
            assert_eq!(size(task.action()), action, "{name}");
        }
    }
}
