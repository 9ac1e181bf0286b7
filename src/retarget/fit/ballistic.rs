//! Free fall: while nothing touches the ground, the centre of mass follows a parabola.
//!
//! A character of other proportions, or an animator's sense of time, makes flights that no gravity makes. Here the centre of
//! mass goes from where it left the ground to where it comes down again along c(t) = c₀ + v t − ½ g t², in the time that the
//! source takes. The body is shifted along with it as a whole.

use super::span::Flight;
use super::trajectory::{Trajectory, share};
use crate::clip::Problem;
use crate::retarget::anchor::Anchor;
use crate::retarget::goals::Goals;
use crate::retarget::model::Model;
use crate::skeleton::GRAVITY;
use nalgebra::{Point3, Vector3};

/// A flight falls at least half as fast as it should: slower ones are steps with feet that float, or slow motion. So it is
/// below its parabola by at most this share of the height to which the flight rises …
const SLOWEST: f64 = 0.5;
/// … and off it by no more than this in any case, leg lengths. One that is far above its parabola is a flight that was drawn too
/// high, or played too fast, and is brought down only for a body that is to perform it. Chosen, as are the others …
const FARTHEST: f64 = 0.35;
/// … and one that is off by less than this is corrected whatever its height, leg lengths.
const CLOSE: f64 = 0.04;
/// Shift above which the user gets a note, metres. Chosen.
const NOTED: f64 = 0.03;

/// How a frame's body is shifted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FlightShift {
    /// World, metres.
    pub by: Vector3<f64>,
    /// Whether the body flies; on the ground it keeps its feet and hands where they stand.
    pub flies: bool,
}

impl FlightShift {
    /// Shifts the root.
    pub fn apply(&self, qpos: &mut [f64]) {
        let root = qpos.iter_mut().zip(&self.by);
        root.for_each(|(x, by)| *x += by);
    }
}

/// How every frame is shifted so that these flights fall freely; `None` where it stays.
pub(super) fn shifts(trajectory: &Trajectory, flights: &[Flight]) -> Vec<Option<FlightShift>> {
    let skeleton = trajectory.model.skeleton;
    let com = |f: usize| skeleton.com(&skeleton.forward(&trajectory.frames[f]));
    let mut shifts = vec![None; trajectory.frames.len()];
    for flight in flights {
        let Some(off) = off_parabola(trajectory, flight.span, com) else {
            continue;
        };
        for (index, shift) in with_leads(flight, &off, trajectory.fps) {
            // A flight over the seam is seen from its own cycle; frames are in the first.
            if let Some((n, f)) = trajectory.locate(index) {
                let back = trajectory.offset(n).rotation.inverse();
                let by = back * shift.by;
                shifts[f] = Some(FlightShift { by, ..shift });
            }
        }
    }
    shifts
}

/// From the frame before a flight to the one after it: how far the centre of mass is from its parabola, metres; `None` if it
/// is so far that this is no flight.
pub(super) fn off_parabola(
    trajectory: &Trajectory,
    (a, b): (i64, i64),
    com: impl Fn(usize) -> Vector3<f64>,
) -> Option<Vec<Vector3<f64>>> {
    let place = |index: i64| {
        let (n, f) = trajectory.locate(index)?;
        Some((trajectory.offset(n) * Point3::from(com(f))).coords)
    };
    let (start, end) = (place(a)?, place(b)?);
    let duration = (b - a) as f64 / trajectory.fps;
    let gravity = Vector3::z() * GRAVITY;
    // The take-off velocity that leads from the start to the end.
    let speed = (end - start) / duration + gravity * (duration / 2.0);
    let off = |index: i64| {
        let t = (index - a) as f64 / trajectory.fps;
        Some(start + speed * t - gravity * (t * t / 2.0) - place(index)?)
    };
    let off: Vec<_> = (a..=b).map(off).collect::<Option<_>>()?;
    let leg = trajectory.model.skeleton.leg_length();
    // The height above the chord of a flight of this duration: g T²/8.
    let rise = GRAVITY * duration * duration / 8.0;
    // How far off is still the same flight in another time or size, and not another motion.
    let most = |share: f64| (share * rise).min(FARTHEST * leg).max(CLOSE * leg);
    let farthest = off.iter().map(Vector3::norm).fold(0.0, f64::max);
    let below = off.iter().map(|by| by.z).fold(0.0, f64::max);
    let is_flight = match trajectory.to_perform {
        true => farthest <= most(f64::INFINITY) && below <= most(SLOWEST),
        false => farthest <= most(SLOWEST),
    };
    is_flight.then_some(off)
}

/// A flight's shifts, and those before and after it that lead to and from their speed.
fn with_leads(flight: &Flight, off: &[Vector3<f64>], fps: f64) -> Vec<(i64, FlightShift)> {
    let last = off.len() - 1;
    let shift = |by, flies| FlightShift { by, flies };
    let leads = flight.leads(fps).into_iter().map(|lead| {
        // Both ends of a flight are on the ground, so the shift of the frame next to it is the speed that is taken up.
        let next = [off[1], off[last - 1]][lead.end];
        (lead.index, shift(next * lead.share, false))
    });
    let flying = off.iter().enumerate().take(last).skip(1);
    let flying = flying.map(|(i, by)| (flight.span.0 + i as i64, shift(*by, true)));
    leads.chain(flying).collect()
}

/// Shifts the targets of frame `f`; `anchors` are the points that stand there.
pub(super) fn shift_goals(
    model: &Model,
    goals: &mut Goals,
    f: usize,
    anchors: &[Anchor],
    shift: &FlightShift,
) {
    for (key, point) in goals.keypoints.iter().zip(&mut goals.points[f]) {
        *point += shift.by * share(model, key.slot, anchors, shift.flies);
    }
}

/// The note `flight-corrected` of flights that were shifted far, by up to so many metres.
pub(super) fn problem(farthest: f64) -> Option<Problem> {
    let message = format!(
        "a flight wasn't a free fall, so the body was shifted by up to {:.0} cm in the air; this adds to its distance from \
         the source",
        farthest * 100.0
    );
    (farthest > NOTED).then(|| Problem::note("flight-corrected", message))
}
