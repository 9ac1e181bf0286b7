//! Authors the clips of `clips/` and writes them:
//!
//! ```text
//! cargo run --release --example author_clips             # writes all clips
//! cargo run --release --example author_clips -- --check  # only says whether they are as committed
//! ```

mod balance;
mod fbx;
mod fbx_tree;
mod figure;
mod glb;
mod idle;
mod kick;
mod rig;
mod spline;
mod walk;

use balance::{Body, Ground, ground, margin};
use rig::{Pose, Rig};
use std::error::Error;
use std::path::Path;
use std::process::ExitCode;

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let check = std::env::args().any(|a| a == "--check");
    let rig = Rig::new();
    let body = Body::new(&rig);
    let kick = kick::poses(&rig);
    let walk = walk::poses(&rig);
    report(&rig, &body, "kick", &kick, &kick::zmp(&body, &rig, &kick));
    report(
        &rig,
        &body,
        "walk",
        &walk,
        &walk::zmp(&body, &rig, &walk, 1.0 / walk::FPS),
    );
    let idle = idle::poses(&rig);
    let still: Vec<Ground> = idle
        .iter()
        .map(|pose| ground(body.com(&rig, pose)))
        .collect();
    report(&rig, &body, "idle", &idle, &still);
    let files = [
        ("idle.glb", glb::document(&rig, &idle, idle::FPS, "idle")),
        ("kick.fbx", fbx::document(&rig, &kick, "kick")?),
        ("walk.glb", glb::document(&rig, &walk, walk::FPS, "walk")),
    ];
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("clips");
    let mut same = true;
    for (name, bytes) in files {
        let path = folder.join(name);
        if !check {
            std::fs::write(&path, &bytes)?;
        } else if std::fs::read(&path)? != bytes {
            eprintln!("clips/{name} differs from what this program makes");
            same = false;
        }
    }
    Ok(if same {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}

/// Says how far inside the support polygon the clip stays.
fn report(rig: &Rig, body: &Body, name: &str, poses: &[Pose], zmp: &[Ground]) {
    let least = |points: &mut dyn Iterator<Item = Ground>| {
        let margins = poses
            .iter()
            .zip(points)
            .map(|(pose, p)| margin(rig, pose, p));
        margins.fold(f64::INFINITY, f64::min) * 1e3
    };
    let of_zmp = least(&mut zmp.iter().copied());
    let of_com = least(&mut poses.iter().map(|pose| ground(body.com(rig, pose))));
    println!(
        "{name}: {} frames; inside the support polygon by at least {of_zmp:.1} mm (zero-moment point), {of_com:.1} mm (centre of mass)",
        poses.len()
    );
}
