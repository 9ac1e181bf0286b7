//! Clips that walk on the spot get their travel back, from the speed at which standing feet slide.

use super::goals::Goals;
use super::model::Model;
use super::stance::soles;
use crate::clip::{LoopMode, Problem, Severity};
use nalgebra::Vector3;

/// A root that moves no further in a cycle than this stays on the spot, leg lengths.
const ON_THE_SPOT: f64 = 0.1;
/// One that is further away from its start on the way travels, leg lengths.
const STRAYS: f64 = 0.25;
/// A foot is down when its lowest point is this near to the clip's lowest, leg lengths.
const DOWN: f64 = 0.04;
/// Slower sliding is taken for sliding, leg lengths per second.
const SLOWEST: f64 = 0.4;
/// Velocities this near to the median, relative to it, agree with it …
const AGREES: f64 = 0.5;
/// … and this part of the frames in which a foot is down has to.
const MAJORITY: f64 = 0.6;

/// The steady travel that a clip on the spot lacks: its feet slide steadily while they are down.
pub(super) fn missing(
    goals: &Goals,
    model: &Model,
    fps: f64,
    leg: f64,
    loop_mode: LoopMode,
) -> Option<Vector3<f64>> {
    let last = goals.frames().checked_sub(1)?;
    let away = |f: usize| (goals.root(f) - goals.root(0)).xy().norm();
    let strays = (0..=last).any(|f| away(f) > STRAYS * leg);
    if strays || away(last) > ON_THE_SPOT * leg {
        return None;
    }
    let soles = soles(model, goals);
    if loop_mode == LoopMode::Clamp && !alternate(&soles) {
        return None;
    }
    Some(-sliding(&soles, fps, leg)?)
}

pub(super) fn problem(velocity: &Vector3<f64>) -> Problem {
    Problem {
        id: "travel-restored".to_owned(),
        severity: Severity::Warning,
        message: format!(
            "the clip moves on the spot with sliding feet; travel of {:.2} m/s was added so that they stand",
            velocity.norm()
        ),
    }
}

/// Whether now the one and now the other half of the sole points (one foot's each) is lower: a gait, and no slide.
fn alternate(soles: &[Vec<Vector3<f64>>]) -> bool {
    let lowest = |points: &[Vector3<f64>]| points.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
    let left = |frame: &Vec<Vector3<f64>>| {
        let (left, right) = frame.split_at(frame.len() / 2);
        lowest(left) < lowest(right)
    };
    let count = soles.iter().filter(|frame| left(frame)).count();
    let least = soles.len() / 5;
    (least..=soles.len() - least).contains(&count) && least > 0
}

/// Velocity at which feet slide while they are down; `None` if they don't, or in no steady way.
fn sliding(soles: &[Vec<Vector3<f64>>], fps: f64, leg: f64) -> Option<Vector3<f64>> {
    let lowest = |points: &[Vector3<f64>]| {
        (0..points.len()).min_by(|a, b| points[*a].z.total_cmp(&points[*b].z))
    };
    let floor = soles
        .iter()
        .flatten()
        .map(|p| p.z)
        .fold(f64::INFINITY, f64::min);
    let mut velocities: Vec<Vector3<f64>> = Vec::new();
    for pair in soles.windows(2) {
        let point = lowest(&pair[0])?;
        if pair[0][point].z < floor + DOWN * leg {
            let v = (pair[1][point] - pair[0][point]) * fps;
            velocities.push(Vector3::new(v.x, v.y, 0.0));
        }
    }
    let middle = Vector3::new(median(&velocities, 0)?, median(&velocities, 1)?, 0.0);
    let speed = middle.norm();
    if speed < SLOWEST * leg {
        return None;
    }
    let agreeing: Vec<Vector3<f64>> = velocities
        .iter()
        .filter(|v| (*v - middle).norm() < AGREES * speed)
        .copied()
        .collect();
    let steady = agreeing.len() as f64 >= MAJORITY * velocities.len() as f64;
    steady.then(|| agreeing.iter().sum::<Vector3<f64>>() / agreeing.len() as f64)
}

fn median(vectors: &[Vector3<f64>], axis: usize) -> Option<f64> {
    let mut values: Vec<f64> = vectors.iter().map(|v| v[axis]).collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}
