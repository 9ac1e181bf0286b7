//! Friction: the ground pushes a body sideways only as hard as it is pressed.
//!
//! In clips of games the hips often stay where they are while everything else swings around them, and feet slide along. No
//! ground could hurl a body about like that. For a body that is to perform the motion, the whole of it is led along a smoother
//! way: the swing is taken out of the centre of mass and put into the hips.

use super::Fit;
use crate::clip::LoopMode;
use crate::motion::{Cycle, Draft, Motion};
use crate::retarget::way::Way;
use crate::skeleton::GRAVITY;
use nalgebra::Vector2;
use std::f64::consts::TAU;

/// Sideways force without which the motion does that no contact supplies, as a share of the weight; only what is beyond it is
/// taken out. Chosen: recordings of people need up to a tenth.
const ALLOWED: f64 = 0.25;
/// Swings that are quicker than this are taken out, slower ones are left, s: a slow swing would move the body far. Chosen.
const PERIOD: f64 = 1.0;
/// Time before and after a flight in which nothing is taken out, s. Chosen: the half width of the window in which accelerations
/// are fitted, and as much again.
const NEAR_FLIGHT: f64 = 0.1;
/// Longest shift that is made in one go, leg lengths. Chosen: 5 cm.
const FARTHEST: f64 = 0.06;

/// How every frame is shifted over the ground, metres; `None` where the ground can push as the motion asks.
pub(super) fn shifts(fit: &Fit, frames: &[Vec<f64>]) -> Option<Vec<Vector2<f64>>> {
    // A cycle that turns would turn the shifts from one to the next.
    if fit.cycle.is_some_and(|cycle| cycle.heading.abs() > 1e-6) {
        return None;
    }
    let lacking = lacking(fit, frames);
    if lacking.iter().all(|a| *a == Vector2::zeros()) {
        return None;
    }
    let way = Way {
        repeats: fit.cycle.is_some(),
        fps: fit.fps,
        // A swing of this period is taken out half.
        stay: (TAU / PERIOD).powi(4),
        follow: 0.0,
        push: 1.0,
    };
    let most = FARTHEST * fit.model.skeleton.leg_length();
    let speeds = vec![Vector2::zeros(); lacking.len()];
    let wished: Vec<_> = lacking.iter().map(|a| -a).collect();
    let mut shifts = way.solve(&speeds, &wished);
    for shift in &mut shifts {
        *shift *= most / shift.norm().max(most);
    }
    Some(shifts)
}

/// The sideways acceleration that no contact supplies beyond what is allowed, by frame, m/s².
fn lacking(fit: &Fit, frames: &[Vec<f64>]) -> Vec<Vector2<f64>> {
    let skeleton = fit.model.skeleton;
    let bodies = skeleton.contact_bodies();
    let qpos = fit.whole_cycle(frames.to_vec());
    let stands = |frame: &Vec<_>| {
        let on = |body: &usize| super::carriers::stands(fit.model, frame, *body);
        bodies.iter().map(on).collect()
    };
    let contact = (0..qpos.len()).map(|f| stands(&fit.anchors[f % fit.anchors.len()]));
    let motion = Motion::from_poses(
        skeleton,
        Draft {
            name: String::new(),
            fps: fit.fps,
            loop_mode: match fit.cycle {
                Some(_) => LoopMode::Wrap,
                None => LoopMode::Clamp,
            },
            cycle: fit.cycle.copied().unwrap_or(Cycle::NONE),
            contact: Some(contact.collect()),
            qpos,
            contact_bodies: bodies.clone(),
        },
    );
    let beyond = |force: Vector2<f64>| {
        let acceleration = force / skeleton.total_mass();
        let size = acceleration.norm();
        let left = (size - ALLOWED * GRAVITY).max(0.0);
        acceleration * (left / size.max(f64::MIN_POSITIVE))
    };
    // What flies is led along a parabola, and that is another stage's work; beside a flight the force of the push is smeared.
    let last = frames.len() as i64 - 1;
    let near = (NEAR_FLIGHT * fit.fps).round() as i64;
    let touches = |index: i64| {
        let at = match fit.cycle {
            Some(_) => index.rem_euclid(last + 1),
            None => index.clamp(0, last),
        };
        motion.tracks.contact[at as usize].contains(&true)
    };
    let lacking = |f: usize| {
        let wrench = &motion.tracks.root_wrench_residual[f];
        let mut around = f as i64 - near..=f as i64 + near;
        match around.all(touches) {
            true => beyond(Vector2::new(wrench[0], wrench[1])),
            false => Vector2::zeros(),
        }
    };
    (0..frames.len()).map(lacking).collect()
}
