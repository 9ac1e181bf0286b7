//! A run learns the same bits at any number of threads, and after being killed and resumed.

mod extremes;

use mimic::clip::LoopMode;
use mimic::import;
use mimic::learn::{PpoConfig, Trainer};
use mimic::motion::Motion;
use mimic::retarget;
use mimic::run::{Plan, Run};
use mimic::skeleton::Skeleton;
use mimic::task::{CharacterModel, ImitationSettings, TaskSettings};
use std::path::Path;
use std::sync::Arc;

fn skeleton() -> Skeleton {
    Skeleton::load("humanoid").expect("the built-in humanoid loads")
}

fn motion(clip: &str) -> Motion {
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("clips")
        .join(clip);
    let clip = import::load(file, &import::Options::default()).expect("our own clip reads");
    retarget::retarget(&clip, &skeleton(), &Default::default())
        .expect("our own clip retargets")
        .motion
}

fn kick() -> Motion {
    motion("kick.fbx")
}

fn both() -> Vec<Motion> {
    vec![kick(), motion("walk.glb")]
}

fn tiny() -> Plan {
    Plan {
        task: ImitationSettings {
            adaptive_starts: 0.5,
            transitions_s: Some([0.2, 0.4]),
            ..ImitationSettings::default()
        }
        .into(),
        ppo: PpoConfig {
            minibatch: 64,
            ..Plan::default().ppo
        },
        hidden: vec![32, 16],
        environments: 12,
        group: 4,
        horizon: 16,
        round: 2,
        samples: 12 * 16 * 6,
        ..Plan::default()
    }
}

fn trainer(plan: &Plan, motions: &[Motion]) -> Trainer {
    let model = CharacterModel::new(skeleton()).expect("a character");
    let task = plan.task.build(Arc::new(model), motions).expect("a task");
    Trainer::new(plan.trainer(), task).expect("a trainer")
}

/// The settings of a plan's task.
fn task(plan: &mut Plan) -> &mut ImitationSettings {
    match &mut plan.task {
        TaskSettings::Imitate(settings) => settings,
        other => panic!("the plan is for {}", other.name()),
    }
}

fn learned(trainer: &mut Trainer, iterations: usize) -> Vec<u32> {
    for _ in 0..iterations {
        let metrics = trainer.iterate().expect("training stays finite");
        assert!(metrics.update.steps > 0, "an iteration learned nothing");
    }
    trainer
        .learner()
        .parameters()
        .iter()
        .map(|p| p.to_bits())
        .collect()
}

fn on_threads(threads: usize, work: impl FnOnce() -> Vec<u32> + Send) -> Vec<u32> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .expect("threads start")
        .install(work)
}

#[test]
fn the_same_seed_gives_the_same_bits_at_any_number_of_threads() {
    let train = |seed| {
        let plan = Plan { seed, ..tiny() };
        learned(&mut trainer(&plan, &both()), 4)
    };
    let one = on_threads(1, || train(7));
    assert_eq!(
        one,
        on_threads(2, || train(7)),
        "two threads learned something else"
    );
    assert_eq!(
        one,
        on_threads(5, || train(7)),
        "five threads learned something else"
    );
    assert_ne!(one, on_threads(1, || train(8)), "the seed changes nothing");
}

#[test]
fn a_killed_run_goes_on_with_the_bits_of_an_unbroken_one() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let whole =
        Run::create(folder.path().join("whole"), tiny(), skeleton(), both()).expect("a run");
    let unbroken = learned(&mut whole.trainer().expect("a trainer"), 6);

    let path = folder.path().join("broken");
    let run = Run::create(&path, tiny(), skeleton(), both()).expect("a run");
    let mut trainer = run.trainer().expect("a trainer");
    learned(&mut trainer, 4);
    assert!(trainer.is_between_rounds());
    let starts = trainer.state().starts;
    let failures = &starts[starts.len() / 2..];
    assert!(failures.iter().sum::<f32>() > 0.0, "nothing to carry over");
    run.save(&trainer).expect("the checkpoint is saved");
    learned(&mut trainer, 1);
    drop((run, trainer));

    let mut resumed = Run::open(&path)
        .expect("the run opens")
        .trainer()
        .expect("a trainer");
    assert_eq!(resumed.iteration(), 4);
    assert_eq!(
        unbroken,
        learned(&mut resumed, 2),
        "the resumed run learned something else"
    );
}

/// An episode that goes over into other motions doesn't end where one of them does.
#[test]
fn transitions_go_on_where_a_motion_ends() {
    let ends = |transitions_s| {
        let mut plan = tiny();
        plan.horizon = 64;
        task(&mut plan).transitions_s = transitions_s;
        task(&mut plan).terminations.fall = false;
        task(&mut plan).terminations.distance = None;
        let mut motions = both();
        motions
            .iter_mut()
            .for_each(|m| m.loop_mode = LoopMode::Clamp);
        let mut trainer = trainer(&plan, &motions);
        trainer.iterate().expect("training stays finite").episodes
    };
    assert!(ends(None) > 0);
    assert_eq!(ends(Some([0.5, 1.0])), 0);
}

#[test]
fn a_run_is_never_overwritten() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    Run::create(folder.path(), tiny(), skeleton(), vec![kick()]).expect("a run");
    let again = Run::create(folder.path(), tiny(), skeleton(), vec![kick()]);
    assert!(
        again
            .err()
            .expect("refused")
            .to_string()
            .contains("already holds a run")
    );
}

#[test]
fn what_cannot_be_trained_is_refused_before_a_folder_appears() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("run");
    type Break = fn(&mut Plan);
    let broken: [(Break, &str); 6] = [
        (|plan| task(plan).physics.control_hz = 0.0, "control_hz"),
        (|plan| task(plan).physics.substeps = 0, "substeps"),
        (|plan| task(plan).episode_s = f64::NAN, "episode_s"),
        (|plan| task(plan).rewards.pose = -1.0, "task.rewards.pose"),
        (|plan| plan.final_std = 0.0, "final_std"),
        (|plan| plan.environments = 0, "environments"),
    ];
    for (spoil, name) in broken {
        let mut plan = tiny();
        spoil(&mut plan);
        let error = Run::create(&path, plan, skeleton(), vec![kick()])
            .err()
            .expect("refused");
        assert!(error.to_string().contains(name), "{error}");
        assert!(!path.exists(), "{name}: a folder was left behind");
    }
}
