//! Carries an animation clip onto a physics character, says how close the motion comes to the clip, and writes it.
//!
//! `cargo run --release --example retarget CLIP OUT.motion [SKELETON]`
//!
//! CLIP is any file that `mimic import` reads, such as `clips/kick.fbx`; SKELETON is the name of a built-in character
//! or a MuJoCo XML file.

use mimic::import;
use mimic::retarget::{self, retarget};
use mimic::skeleton::Skeleton;
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let usage = "usage: retarget CLIP OUT.motion [SKELETON]";
    let (clip, out) = (args.next().ok_or(usage)?, args.next().ok_or(usage)?);
    let skeleton = args.next().unwrap_or_else(|| "humanoid".to_owned());

    // A file can hold several takes: the one with most motion is read unless the options name another.
    let clip = import::load(&clip, &import::Options::default())?;
    let skeleton = Skeleton::load(&skeleton)?;
    let retargeted = retarget(&clip, &skeleton, &retarget::Options::default())?;

    let report = &retargeted.report;
    println!(
        "{}: {} frames, keypoints {:.1} cm from the clip's on average, feet skate at {:.1} cm/s",
        clip.name,
        report.frames,
        100.0 * report.keypoint_error_m.mean,
        100.0 * report.foot_skate_m_s,
    );
    for problem in &report.problems {
        println!("note: {}", problem.message);
    }

    // What is written is what training reads: coordinates, velocities and contacts, frame by frame.
    retargeted.motion.save(Path::new(&out))?;
    Ok(())
}
