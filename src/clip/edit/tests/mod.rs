mod join;
mod loops;
mod mirror;
mod time;
mod travel;

use crate::clip::{Clip, Error, Joint, LoopMode, Margin, Source};
use crate::import;
use mimic_test_support::foreign;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

/// One of the clips in `clips/`.
fn ours(file: &str) -> Clip {
    let path = format!("{}/clips/{file}", env!("CARGO_MANIFEST_DIR"));
    import::load(path, &import::Options::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// A clip that others made, if it is there.
fn theirs(file: &str, take: Option<&str>) -> Option<Clip> {
    let path = foreign(file)?;
    let options = import::Options {
        take: take.map(str::to_owned),
        ..Default::default()
    };
    Some(import::load(path, &options).unwrap_or_else(|e| panic!("{e}")))
}

fn joint(name: &str, parent: Option<usize>, rest: Isometry3<f64>) -> Joint {
    Joint {
        name: name.to_owned(),
        parent,
        rest,
        bone: None,
    }
}

fn clip(joints: Vec<Joint>, fps: f64, frames: Vec<Vec<Isometry3<f64>>>) -> Clip {
    Clip {
        name: "made".to_owned(),
        fps,
        loop_mode: LoopMode::Clamp,
        joints,
        frames,
        margin: Margin::default(),
        source: Source {
            file: "made.bvh".to_owned(),
            sha256: String::new(),
            format: "bvh".to_owned(),
            take: "made".to_owned(),
            fps,
            up_axis: "+Y".to_owned(),
            unit_m: 1.0,
        },
        problems: Vec::new(),
    }
}

fn about(axis: Vector3<f64>, angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(axis.normalize() * angle)
}

fn at(x: f64, y: f64, z: f64) -> Isometry3<f64> {
    Isometry3::translation(x, y, z)
}

fn place(clip: &Clip, name: &str, frame: usize) -> Vector3<f64> {
    let joint = clip.joints.iter().position(|joint| joint.name == name);
    clip.world(frame)[joint.expect("the joint")]
        .translation
        .vector
}

/// Greatest distance between the same joints of two frames, metres.
fn apart(a: &[Isometry3<f64>], b: &[Isometry3<f64>]) -> f64 {
    let distance = |(a, b): (&Isometry3<f64>, &Isometry3<f64>)| {
        (a.translation.vector - b.translation.vector).norm()
    };
    a.iter().zip(b).map(distance).fold(0.0, f64::max)
}

/// Greatest change of a local transform: metres, or radians.
fn local_change(a: &[Isometry3<f64>], b: &[Isometry3<f64>]) -> f64 {
    let angle = |(a, b): (&Isometry3<f64>, &Isometry3<f64>)| {
        let (a, b) = (a.rotation.quaternion(), b.rotation.quaternion());
        UnitQuaternion::new_normalize(*a).angle_to(&UnitQuaternion::new_normalize(*b))
    };
    a.iter().zip(b).map(angle).fold(apart(a, b), f64::max)
}

/// Greatest change of any local transform between neighbouring frames.
fn largest_jump(clip: &Clip) -> f64 {
    let jumps = clip.frames.windows(2).map(|w| local_change(&w[0], &w[1]));
    jumps.fold(0.0, f64::max)
}

/// Whatever a clip may lack or hold, edits refuse it or cope.
#[test]
fn no_clip_brings_an_edit_down() {
    let walk = ours("walk.glb");
    let with = |fps: f64, frames: usize| Clip {
        fps,
        frames: walk.frames[..frames].to_vec(),
        ..walk.clone()
    };
    let mut nan = walk.clone();
    nan.frames[3][0].translation.x = f64::NAN;
    nan.frames[7][4].rotation =
        UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(f64::NAN, 0.0, 0.0, 0.0));
    let mut ragged = walk.clone();
    ragged.frames[2].pop();
    let mut looped = walk.clone();
    looped.joints[0].parent = Some(3);
    let mut bare = walk.clone();
    bare.joints.clear();
    let broken = [
        with(0.0, 34),
        with(f64::NAN, 34),
        with(-30.0, 34),
        with(30.0, 0),
        ragged,
        looped,
        bare,
    ];
    for clip in &broken {
        for edit in edits(clip) {
            assert!(matches!(edit, Err(Error::Unusable { .. })), "{edit:?}");
        }
    }
    for clip in [with(30.0, 1), with(30.0, 2), with(30.0, 3), nan] {
        edits(&clip);
    }
    for value in [f64::NAN, f64::INFINITY, -1.0, 0.0, 1e-300] {
        assert!(walk.speed(value, 30.0).is_err(), "{value}");
    }
    assert!(walk.speed(1e-6, 30.0).is_err(), "too long");
    assert!(walk.travel([f64::NAN, 0.0].into()).is_err());
    assert!(walk.cut_loop(f64::NAN).is_err() && walk.cut_loop(9.0).is_err());
    assert!(walk.cut_loop(1e300).is_err() && walk.cut_loop(-1.0).is_err());
    let all = walk.cut_loop(0.0).expect("any length will do");
    assert!(all.frames.len() > 2);
    assert!(Clip::join(&[walk.clone(), walk.clone()], 1e300).is_ok());
    assert!(Clip::join(&[walk.clone(), walk.clone()], f64::NAN).is_err());
    assert!(Clip::join(&[], 0.2).is_err());
    assert!(walk.warp(&[(0.5, f64::NAN)], 30.0).is_err());
    assert!(walk.warp(&[(0.5, 0.8)], f64::NAN).is_err());
}

fn edits(clip: &Clip) -> Vec<Result<Clip, Error>> {
    let plane = super::Plane::sagittal(&clip.joints, &[]);
    vec![
        clip.mirror(&[], &plane),
        Clip::join(&[clip.clone(), clip.clone()], 0.2),
        clip.cut_loop(0.1),
        clip.in_place(),
        clip.speed(2.0, 30.0),
        clip.warp(&[], 30.0),
    ]
}
