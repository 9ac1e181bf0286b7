//! A part of a take becomes the same motion as that part of the whole.

use super::*;

const FOLDERS: [&str; 9] = [
    "cmu",
    "deepmimic",
    "games105",
    "khronos",
    "makehuman",
    "mixamo",
    "mixamo/locomotion-pack",
    "poser-bvh",
    "rigify",
];
/// Frames cut off, and the fewest that have to be left.
const OFF_START: usize = 10;
const OFF_END: usize = 5;
const LEFT: usize = 10;
/// Metres.
const SAME: f64 = 0.002;

fn files() -> Vec<String> {
    let folders = FOLDERS.iter().filter_map(|folder| foreign(folder));
    let entries = folders.filter_map(|path| std::fs::read_dir(path).ok());
    let paths = entries.flatten().flatten().map(|entry| entry.path());
    let kinds = ["fbx", "glb", "bvh", "amc", "txt"];
    let is_clip = |path: &std::path::PathBuf| {
        let kind = path.extension().and_then(|kind| kind.to_str());
        kind.is_some_and(|kind| kinds.contains(&kind))
    };
    let paths = paths.filter(is_clip).map(|p| p.display().to_string());
    let mut paths: Vec<String> = paths.collect();
    paths.sort();
    paths
}

/// The motion of a part of a file's take.
fn motion(file: &str, trim: Option<(f64, f64)>) -> Option<(Clip, Motion)> {
    let options = import::Options {
        trim,
        loop_mode: Some(LoopMode::Clamp),
        ..Default::default()
    };
    let clip = import::load(file, &options).ok()?;
    let done = retarget(&clip, &humanoid(), &Options::default()).ok()?;
    Some((clip, done.motion))
}

/// Largest distance between bodies of the part and of the whole, which starts elsewhere over the ground, metres.
fn apart(part: &Motion, whole: &[Vec<Isometry3<f64>>]) -> f64 {
    let at = |frame: &[Isometry3<f64>], body: usize| frame[body].translation.vector;
    let moved = (at(&whole[0], 0) - at(&part.bodies[0], 0)).xy().push(0.0);
    let frames = part.bodies.iter().zip(whole);
    let pairs = frames.flat_map(|(a, b)| (0..a.len()).map(move |j| at(a, j) + moved - at(b, j)));
    pairs.map(|gap| gap.norm()).fold(0.0, f64::max)
}

#[test]
fn a_part_moves_as_it_does_in_the_whole() {
    let (mut compared, mut differ) = (0, Vec::new());
    for file in files() {
        let Some((clip, whole)) = motion(&file, None) else {
            continue;
        };
        // The first frame of the take may have been left out.
        let left_out = clip.problems.iter().any(|p| p.id == "first-frame-left-out");
        let first = OFF_START + usize::from(left_out);
        let Some(last) = clip.frames.len().checked_sub(OFF_END + 1) else {
            continue;
        };
        if last < OFF_START + LEFT {
            continue;
        }
        let end = (last + usize::from(left_out)) as f64 / clip.fps;
        let (_, part) = motion(&file, Some((first as f64 / clip.fps, end))).expect("a part");
        let times = (whole.fps / clip.fps).round() as usize;
        let apart = apart(&part, &whole.bodies[times * OFF_START..=times * last]);
        let frames = times * (last - OFF_START) + 1;
        assert_eq!(part.bodies.len(), frames, "{file}");
        compared += 1;
        if apart > SAME {
            differ.push(format!("{file}: {apart:.4} m"));
        }
    }
    eprintln!("{compared} clips compared");
    assert!(differ.is_empty(), "{differ:#?}");
}

/// In a file of its own, a part has what was around it.
#[test]
fn a_part_that_was_saved_moves_as_it_does_in_the_whole() {
    let ours = format!("{}/clips/kick.fbx", env!("CARGO_MANIFEST_DIR"));
    let whole = import::load(&ours, &import::Options::default()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("part.clip");
    let cut = |clip: &Clip| clip.trim(12.0 / clip.fps, 60.0 / clip.fps).unwrap();
    let whole = Clip {
        loop_mode: LoopMode::Clamp,
        ..whole
    };
    cut(&whole).save(&path).unwrap();
    let part = on_humanoid(&Clip::load(&path).unwrap()).motion;
    let whole = on_humanoid(&whole).motion;
    let apart = apart(&part, &whole.bodies[12..=60]);
    assert!(apart < SAME, "{apart} m");
}
