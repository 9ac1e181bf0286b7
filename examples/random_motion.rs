//! Writes a smooth random motion of a skeleton, and beside it, as JSON, the masses of its bodies and the torques of its
//! joints. `tests/outside/mujoco_motion.py` checks both against MuJoCo.
//!
//! `cargo run --release --example random_motion OUT.motion [SKELETON]`

use mimic::clip::LoopMode;
use mimic::motion::{Cycle, Draft, Motion};
use mimic::skeleton::Skeleton;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde_json::json;
use std::error::Error;
use std::f64::consts::TAU;
use std::path::Path;

const FPS: f64 = 240.0;
const FRAMES: usize = 481;

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let out = args
        .next()
        .ok_or("usage: random_motion OUT.motion [SKELETON]")?;
    let skeleton = Skeleton::load(args.next().unwrap_or_else(|| "humanoid".into()))?;
    let waves = waves(skeleton.nv, &mut ChaCha8Rng::seed_from_u64(1));
    let rest = skeleton.rest_qpos();
    let qpos = (0..FRAMES)
        .map(|f| {
            let time = f as f64 / FPS;
            let shift: Vec<f64> = waves.iter().map(|wave| wave.at(time)).collect();
            skeleton.integrate(&rest, &shift, 1.0)
        })
        .collect();
    let draft = Draft {
        name: "random".into(),
        fps: FPS,
        loop_mode: LoopMode::Clamp,
        cycle: Cycle::NONE,
        qpos,
        contact_bodies: Vec::new(),
        contact: None,
    };
    let motion = Motion::from_poses(&skeleton, draft);
    motion.save(&out)?;
    let beside =
        json!({ "masses": masses(&skeleton), "joint_torques": motion.joint_torques(&skeleton) });
    std::fs::write(Path::new(&out).with_extension("json"), beside.to_string())?;
    Ok(())
}

/// Mass, centre and inertia (row by row) of every body, as the skeleton has them.
fn masses(skeleton: &Skeleton) -> Vec<serde_json::Value> {
    let row = |b: &mimic::skeleton::Body| {
        let inertia: Vec<f64> = b.inertia.transpose().iter().copied().collect();
        json!({ "mass": b.mass, "com": b.com.as_slice(), "inertia": inertia })
    };
    skeleton.bodies.iter().map(row).collect()
}

/// Movement of one degree of freedom: the sum of two sines. Amplitudes are in rad or m, frequencies in Hz.
struct Wave {
    amplitude: [f64; 2],
    frequency: [f64; 2],
    phase: [f64; 2],
}

impl Wave {
    fn at(&self, time: f64) -> f64 {
        (0..2)
            .map(|i| self.amplitude[i] * (TAU * self.frequency[i] * time + self.phase[i]).sin())
            .sum()
    }
}

/// Random waves, slow and small enough to stay within what joints do (chosen).
fn waves(count: usize, random: &mut ChaCha8Rng) -> Vec<Wave> {
    let mut uniform = |low: f64, high: f64| {
        let unit = f64::from(random.next_u32()) / f64::from(u32::MAX);
        low + (high - low) * unit
    };
    let mut pair = |low, high| [uniform(low, high), uniform(low, high)];
    (0..count)
        .map(|_| Wave {
            amplitude: pair(0.1, 0.4),
            frequency: pair(0.1, 0.4),
            phase: pair(0.0, TAU),
        })
        .collect()
}
