//! The span of a flight in time, and the frames around it in which the body takes up and leaves the flight's speed.

/// Time before and after a flight in which the body takes up and leaves the speed that was changed, s. Chosen: about what a
/// push from the ground takes.
const GATHERS: f64 = 0.15;
/// Beginnings and ends of a flight that are tried beside the first. Chosen, to bound the time at high frame rates.
const LENGTHS: usize = 4;

/// A flight. Indices may go beyond the frames of a trajectory that repeats.
#[derive(Clone, Debug)]
pub(super) struct Flight {
    /// Indices of the last frame on the ground before it and of the first after it.
    pub span: (i64, i64),
    /// Frames on the ground before and after it.
    pub room: [i64; 2],
    /// How many of these frames may belong to the flight: the body is near the ground there, and may push on it or not.
    pub near: [i64; 2],
}

/// A frame on the ground before or after a flight.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lead {
    /// Its index.
    pub index: i64,
    /// 0 before the flight, 1 after it.
    pub end: usize,
    /// How far the body goes there, as a multiple of how far it goes in the flight's frame next to the ground.
    pub share: f64,
}

impl Flight {
    /// The same flight in the lengths that it may have, or some of them where there are many; the longest comes first.
    pub fn lengths(&self) -> impl Iterator<Item = Flight> {
        let ((a, b), [before, after]) = (self.span, self.room);
        let [earlier, later] = self.near.map(|near| {
            // Every frame at low rates, about four beginnings and ends at high ones.
            let every = (near as usize / LENGTHS).max(1);
            (0..=near).rev().step_by(every)
        });
        let spans = earlier.flat_map(move |i| later.clone().map(move |j| (i, j)));
        spans.map(move |(i, j)| Flight {
            span: (a - i, b + j),
            room: [before - i, after - j],
            near: [0, 0],
        })
    }

    /// The frames before and after the flight in which the body takes up its speed and leaves it again, at `fps` Hz.
    ///
    /// The way there is the cubic −w u²(1 − u), u rising from 0 to 1 within the w frames next to the flight: it begins at
    /// rest, goes the other way first, and comes back with the speed of one unit a frame. A stance between two flights is
    /// shared by them.
    pub fn leads(&self, fps: f64) -> Vec<Lead> {
        let longest = (GATHERS * fps).round();
        let (a, b) = self.span;
        let mut found = Vec::new();
        for (end, (from, step)) in [(a, -1), (b, 1)].into_iter().enumerate() {
            // Half of the frames on the ground, so that a stance between two flights serves both.
            let width = longest.min(self.room[end] as f64 / 2.0);
            for away in 1..width.ceil() as i64 {
                let u = 1.0 - away as f64 / width;
                found.push(Lead {
                    index: from + step * away,
                    end,
                    share: -width * u * u * (1.0 - u),
                });
            }
        }
        found
    }
}
