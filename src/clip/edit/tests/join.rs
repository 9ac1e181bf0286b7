use super::*;

/// How a clip's last pose, or first, stands on the ground: the place of its hips and their heading.
fn stance(clip: &Clip, frame: usize) -> (Vector3<f64>, f64) {
    let hips = clip.world(frame)[0];
    let ahead = hips.rotation * Vector3::x();
    (hips.translation.vector, ahead.y.atan2(ahead.x))
}

#[test]
fn parts_of_a_clip_join_to_the_clip() {
    let turned = |clip: Clip, turn: f64| {
        let mut clip = clip;
        let carry = Isometry3::from_parts(
            Vector3::new(3.0, -2.0, 0.0).into(),
            about(Vector3::z(), turn),
        );
        for frame in &mut clip.frames {
            frame[0] = carry * frame[0];
        }
        clip
    };
    for (file, cuts) in [("walk.glb", [0.3, 0.7]), ("kick.fbx", [0.4, 1.2])] {
        let clip = ours(file);
        let part = |from: f64, to: f64| clip.trim(from, to).expect("it trims");
        let parts = [
            part(0.0, cuts[0]),
            turned(part(cuts[0], cuts[1]), 1.9),
            turned(part(cuts[1], f64::INFINITY), -0.4),
        ];
        // Files round to 6e-8.
        for (blend, limit) in [(0.0, 1e-8), (0.2, 1e-2)] {
            let whole = Clip::join(&parts, blend).expect("it joins");
            assert_eq!(whole.frames.len(), clip.frames.len());
            let error = (clip.frames.iter().zip(&whole.frames))
                .map(|(a, b)| local_change(a, b))
                .fold(0.0, f64::max);
            println!("{file}, blend {blend} s: {error:.1e}");
            assert!(error < limit, "{file}, blend {blend}: {error}");
        }
    }
}

#[test]
fn walking_on_is_no_faster_than_walking() {
    let walk = ours("walk.glb");
    let walks = Clip::join(&[walk.clone(), walk.clone(), walk.clone()], 0.2).expect("it joins");
    assert_eq!(walks.frames.len(), 3 * 33 + 1);
    assert!(largest_jump(&walks) < 1.001 * largest_jump(&walk));
    let travelled = place(&walks, "Hips", 99) - place(&walks, "Hips", 0);
    let stride = place(&walk, "Hips", 33) - place(&walk, "Hips", 0);
    assert!((travelled - 3.0 * stride).norm() < 1e-3);
}

/// Different poses, places and headings: velocity never jumps by more than the blend's own acceleration.
#[test]
fn different_clips_meet_without_a_jump() {
    let (walk, kick) = (ours("walk.glb"), ours("kick.fbx"));
    let kick = kick.resample(30.0).expect("it resamples");
    let half = walk.trim(0.0, 0.5).expect("it trims");
    let blend = 0.4;
    let both = Clip::join(&[half.clone(), kick.clone()], blend).expect("it joins");
    let seam = half.frames.len() - 1;
    assert_eq!(both.frames.len(), seam + kick.frames.len());
    // Outside the blend, the first is untouched and the next is its own, moved over the ground.
    let window = (0.5 * blend * 30.0) as usize;
    assert_eq!(both.frames[..=seam - window], half.frames[..=seam - window]);
    for f in window..kick.frames.len() {
        assert_eq!(both.frames[seam + f][1..], kick.frames[f][1..]);
        let rise = both.frames[seam + f][0].translation.z - kick.frames[f][0].translation.z;
        assert!(rise.abs() < 1e-9, "over the ground, not through it");
    }
    // What is apart, and how fast it moves apart, bounds speed and acceleration of the cubics between.
    let gap = local_change(&half.frames[seam][1..], &kick.frames[0][1..]);
    let own = largest_jump(&half).max(largest_jump(&kick));
    let allowed = own + (1.5 * 0.5 * gap + 2.0 * own) / window as f64 * 2.0;
    assert!(
        largest_jump(&both) < allowed,
        "{} {allowed}",
        largest_jump(&both)
    );
    let (end, _) = stance(&half, seam);
    let (met, _) = stance(&both, seam);
    assert!(
        (end - met).xy().norm() < 0.02,
        "on the same place of the ground"
    );
}

#[test]
fn the_next_begins_where_and_as_the_last_ends() {
    // The same pose at the end of one and the start of the next, elsewhere and turned.
    let kick = ours("kick.fbx");
    let mut elsewhere = kick.clone();
    let carry = Isometry3::from_parts(Vector3::new(5.0, 1.0, 0.0).into(), about(Vector3::z(), 2.2));
    elsewhere.frames.reverse();
    for frame in &mut elsewhere.frames {
        frame[0] = carry * frame[0];
    }
    let both = Clip::join(&[kick.clone(), elsewhere], 0.0).expect("it joins");
    let seam = kick.frames.len() - 1;
    for f in 0..=seam {
        let (a, b) = (stance(&both, seam - f), stance(&both, seam + f));
        assert!((a.0 - b.0).norm() < 1e-6 && (a.1 - b.1).abs() < 1e-6, "{f}");
    }
}

#[test]
fn other_rates_and_orders_of_joints_are_taken() {
    let walk = ours("walk.glb");
    let mut other = walk.resample(60.0).expect("it resamples");
    // The last two leaves change places.
    let (a, b) = (walk.joints.len() - 2, walk.joints.len() - 1);
    let leaf = |j: usize| walk.joints.iter().all(|joint| joint.parent != Some(j));
    assert!(leaf(b));
    if leaf(a) {
        other.joints.swap(a, b);
        for frame in &mut other.frames {
            frame.swap(a, b);
        }
    }
    let both = Clip::join(&[walk.clone(), other], 0.2).expect("it joins");
    assert_eq!((both.frames.len(), both.fps), (67, 30.0));
    assert!(largest_jump(&both) < 1.01 * largest_jump(&walk));
}

#[test]
fn clips_of_other_figures_are_refused() {
    let walk = ours("walk.glb");
    let mut renamed = walk.clone();
    renamed.joints[4].name = "Hut".to_owned();
    let error = Clip::join(&[walk.clone(), renamed], 0.2)
        .expect_err("refused")
        .to_string();
    assert!(
        error.contains("`Hut`") && error.contains("one figure"),
        "{error}"
    );
    let mut moved = walk.clone();
    moved.joints[4].parent = Some(0);
    let error = Clip::join(&[walk.clone(), moved], 0.2)
        .expect_err("refused")
        .to_string();
    assert!(error.contains(&walk.joints[4].name), "{error}");
    let mut taller = walk.clone();
    taller.joints[2].rest.translation.z += 0.2;
    let both = Clip::join(&[walk, taller], 0.2).expect("it joins");
    assert_eq!(
        both.problems.last().map(|p| p.id.as_str()),
        Some("other-rest")
    );
}
