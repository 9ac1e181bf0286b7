use super::*;

/// Frame `f` of a loop that may be walked on beyond its end: `f` in its cycle, and how often it was gone through.
fn on(clip: &Clip, f: usize) -> Vec<Isometry3<f64>> {
    let last = clip.frames.len() - 1;
    let (first, end) = (clip.world(0), clip.world(last));
    // The hips are the root: their turn about Z and shift over the ground is the cycle's.
    let turn = end[0].rotation * first[0].rotation.inverse();
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 2.0 * turn.k.atan2(turn.w));
    let mut shift = end[0].translation.vector - turn * first[0].translation.vector;
    shift.z = 0.0;
    let carry = Isometry3::from_parts(shift.into(), turn);
    let cycles = f / last;
    let carried = (0..cycles).fold(Isometry3::identity(), |all, _| carry * all);
    clip.world(f % last).iter().map(|at| carried * at).collect()
}

/// Greatest second difference of any joint's place around the seam, and away from it, metres per frame².
fn bends(clip: &Clip) -> (f64, f64) {
    let last = clip.frames.len() - 1;
    let bend = |f: usize| {
        let (a, b, c) = (on(clip, f - 1), on(clip, f), on(clip, f + 1));
        let places = a.iter().zip(&b).zip(&c);
        let bend = places.map(|((a, b), c)| {
            (a.translation.vector - 2.0 * b.translation.vector + c.translation.vector).norm()
        });
        bend.fold(0.0, f64::max)
    };
    let inside = (1..last).map(bend).fold(0.0, f64::max);
    (bend(last), inside)
}

fn assert_closed(clip: &Clip, slack: f64) {
    let last = clip.frames.len() - 1;
    assert_eq!(clip.loop_mode, LoopMode::Wrap);
    let gap = local_change(&clip.frames[0][1..], &clip.frames[last][1..]);
    assert!(gap < 1e-6, "pose: {gap}");
    let rise = clip.frames[0][0].translation.z - clip.frames[last][0].translation.z;
    assert!(rise.abs() < 1e-6, "height: {rise}");
    let (seam, inside) = bends(clip);
    assert!(seam < slack * inside, "velocity: {seam} {inside}");
}

#[test]
fn three_walks_hold_one_cycle() {
    let walk = ours("walk.glb");
    let walks = Clip::join(&[walk.clone(), walk.clone(), walk.clone()], 0.2).expect("it joins");
    let found = walks.find_loop(0.5).expect("a loop");
    assert_eq!(found.end - found.start, 33, "{found:?}");
    assert!(found.gap < 1e-3, "{found:?}");
    let cycle = walks.cut_loop(0.5).expect("a loop");
    assert_closed(&cycle, 1.5);
    let (mine, all) = (largest_jump(&cycle), largest_jump(&walk));
    assert!(mine < 1.01 * all, "{mine} {all}");
    // Two cycles where one is too short.
    let found = walks.find_loop(1.5).expect("a loop");
    assert_eq!(found.end - found.start, 66, "{found:?}");
}

/// At other rates the search is coarse first; the cycle is found to the frame nevertheless.
#[test]
fn a_long_take_holds_the_same_cycle() {
    let walk = ours("walk.glb").resample(240.0).expect("it resamples");
    let cycle = walk.frames.len() - 1;
    let walks = vec![walk.clone(); 30];
    let walks = Clip::join(&walks, 0.1).expect("it joins");
    let found = walks.find_loop(0.5).expect("a loop");
    assert_eq!(found.end - found.start, cycle, "{found:?}");
}

/// A clip that is already one cycle is left as it is, up to what its file rounds.
#[test]
fn one_cycle_is_taken_whole() {
    let walk = ours("walk.glb");
    let cycle = walk.cut_loop(1.0).expect("a loop");
    assert_eq!(cycle.frames.len(), walk.frames.len());
    let error = (walk.frames.iter().zip(&cycle.frames))
        .map(|(a, b)| local_change(a, b))
        .fold(0.0, f64::max);
    assert!(error < 1e-5, "{error}");
}

/// A walker that drifts: every cycle leans further, turns and gets faster, so that nothing closes by itself.
fn drifting(frames: usize) -> Clip {
    let joints = vec![
        joint("hips", None, at(0.0, 0.0, 1.0)),
        joint("leg.l", Some(0), at(0.0, 0.1, 0.0)),
        joint("leg.r", Some(0), at(0.0, -0.1, 0.0)),
        joint("foot.l", Some(1), at(0.0, 0.0, -0.9)),
        joint("foot.r", Some(2), at(0.0, 0.0, -0.9)),
        joint("head", Some(0), at(0.0, 0.0, 0.6)),
    ];
    let frame = |f: usize| {
        let t = f as f64 / 60.0;
        let phase = std::f64::consts::TAU * (t + 0.01 * t * t);
        let heading = about(Vector3::z(), 0.3 * t);
        let lean = about(Vector3::y(), 0.02 * t);
        let mut frame: Vec<_> = joints.iter().map(|joint| joint.rest).collect();
        let place = Vector3::new(
            4.0 * (0.3 * t).sin(),
            4.0 - 4.0 * (0.3 * t).cos(),
            1.0 - 0.002 * t,
        );
        frame[0] = Isometry3::from_parts(place.into(), heading * lean);
        frame[1].rotation = about(Vector3::y(), 0.5 * phase.sin());
        frame[2].rotation = about(Vector3::y(), -0.5 * phase.sin());
        frame
    };
    clip(joints.clone(), 60.0, (0..frames).map(frame).collect())
}

#[test]
fn a_seam_is_closed_in_pose_and_velocity() {
    let take = drifting(400);
    let cycle = take.cut_loop(0.7).expect("a loop");
    assert!(
        (50..70).contains(&cycle.frames.len()),
        "{}",
        cycle.frames.len()
    );
    assert_closed(&cycle, 1.5);
    let open = take.trim(1.0, 2.0).expect("it trims");
    let gap = local_change(&open.frames[0][1..], &open.frames[60][1..]);
    assert!(gap > 1e-2, "it was open: {gap}");
}

#[test]
fn takes_of_others_are_closed() {
    for (file, slack) in [
        ("deepmimic/humanoid3d_walk.txt", 2.0),
        ("cmu/cmu_12_01_walk.bvh", 2.0),
    ] {
        let Some(take) = theirs(file, None) else {
            return;
        };
        let cycle = take.cut_loop(0.5).expect("a loop");
        println!(
            "{file}: {} frames of {}",
            cycle.frames.len(),
            take.frames.len()
        );
        assert_closed(&cycle, slack);
    }
}

#[test]
fn what_stands_still_holds_no_cycle() {
    let mut still = ours("walk.glb");
    let first = still.frames[0].clone();
    still
        .frames
        .iter_mut()
        .for_each(|frame| frame.clone_from(&first));
    assert!(matches!(still.cut_loop(0.2), Err(Error::NoCycle { .. })));
}
