//! Clips whose hips were nailed in the air.

use super::*;
use crate::motion::Motion;

/// Our own clip of this name.
fn ours(file: &str) -> Clip {
    let path = format!("{}/clips/{file}", env!("CARGO_MANIFEST_DIR"));
    import::load(path, &import::Options::default()).unwrap_or_else(|e| panic!("{file}: {e}"))
}

/// The same clip without the way of its hips.
fn nailed(clip: &Clip) -> Clip {
    let map = crate::humanoid::map(&clip.joints).unwrap_or_else(|e| panic!("{e}"));
    let hips = map.joint(Slot::Hips).expect("it has hips");
    let mut clip = clip.clone();
    let first = clip.world(0)[hips].translation.vector;
    for f in 0..clip.frames.len() {
        let by = first - clip.world(f)[hips].translation.vector;
        clip.frames[f][0].translation.vector += by;
    }
    clip
}

/// How far the roots of two motions are from each other in the mean, metres: over the ground and in height, each seen from
/// its own mean.
fn apart(a: &Motion, b: &Motion) -> [f64; 2] {
    let count = a.bodies.len() as f64;
    let root = |m: &Motion, f: usize| m.bodies[f][0].translation.vector;
    let mean = |m: &Motion| {
        (0..m.bodies.len())
            .map(|f| root(m, f))
            .sum::<Vector3<f64>>()
            / count
    };
    let (of_a, of_b) = (mean(a), mean(b));
    let off = |f: usize| (root(a, f) - of_a) - (root(b, f) - of_b);
    let sum =
        |size: &dyn Fn(Vector3<f64>) -> f64| (0..a.bodies.len()).map(|f| size(off(f))).sum::<f64>();
    [sum(&|v| v.xy().norm()) / count, sum(&|v| v.z.abs()) / count]
}

/// The hips of a kick come back to where they were, by what stands on the ground alone.
#[test]
fn nailed_hips_get_their_way_back() {
    let clip = ours("kick.fbx");
    let whole = on_humanoid(&clip);
    let back = on_humanoid(&nailed(&clip));
    let told = |r: &Retargeted| r.report.problems.iter().any(|p| p.id == "hips-restored");
    assert!(told(&back) && !told(&whole));
    let [over_ground, height] = apart(&whole.motion, &back.motion);
    assert!(
        over_ground < 0.03 && height < 0.01,
        "{over_ground} {height}"
    );
}

/// Hips that stand still because nothing moves have lost nothing.
#[test]
fn who_stands_still_isnt_nailed() {
    let skeleton = humanoid();
    let rest = skeleton.rest_qpos();
    let mut frames = vec![rest.clone(); 60];
    for (f, qpos) in frames.iter_mut().enumerate() {
        let angle = 0.5 * (f as f64 / 10.0).sin();
        turned(&skeleton, qpos, Slot::LeftUpperArm, [0.0, angle, 0.0]);
    }
    let still = on_humanoid(&rig(&skeleton, &rest, &frames, 1.0, 0.0));
    assert!(
        still
            .report
            .problems
            .iter()
            .all(|p| p.id != "hips-restored")
    );
}

/// Part of a take goes the way that it goes in the whole.
#[test]
fn part_of_a_nailed_take_goes_the_same_way() {
    let clip = Clip {
        loop_mode: LoopMode::Clamp,
        ..nailed(&ours("kick.fbx"))
    };
    // Long enough that its end is beyond what a part keeps of it.
    let mut long = clip.clone();
    for _ in 0..3 {
        long.frames.extend_from_slice(&clip.frames);
    }
    let whole = on_humanoid(&long).motion;
    let (from, to) = (clip.frames.len() + 12, clip.frames.len() + 60);
    let part = long.trim(from as f64 / long.fps, to as f64 / long.fps);
    let part = on_humanoid(&part.unwrap_or_else(|e| panic!("{e}"))).motion;
    let whole = Motion {
        bodies: whole.bodies[from..=to].to_vec(),
        ..whole
    };
    let [over_ground, height] = apart(&whole, &part);
    assert!(
        over_ground < 0.002 && height < 0.002,
        "{over_ground} {height}"
    );
}
