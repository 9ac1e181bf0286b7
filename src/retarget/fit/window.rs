//! Which frames are solved for together.

/// Frames that are solved together: `count` from `start` on, in a trajectory of `total`. In one that repeats, a window may
/// pass over the end. The frames around the window stay as they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::retarget) struct Window {
    /// The first frame.
    pub start: usize,
    /// How many frames.
    pub count: usize,
    /// Frames of the trajectory, without the last one of a cycle.
    pub total: usize,
    /// Whether the trajectory repeats.
    pub repeats: bool,
}

impl Window {
    /// The frame at a place in the window; places before its start and after its end are the frames around it. `None` beyond
    /// the ends of a trajectory that doesn't repeat.
    pub fn frame(&self, place: i64) -> Option<usize> {
        let (at, total) = (self.start as i64 + place, self.total as i64);
        let inside = (0..total).contains(&at) || self.repeats;
        inside.then(|| at.rem_euclid(total.max(1)) as usize)
    }

    /// The frames, in order of time.
    pub fn frames(self) -> impl Iterator<Item = usize> {
        (0..self.count as i64).filter_map(move |place| self.frame(place))
    }

    /// Whether the window is a whole cycle, so that its end is beside its start.
    pub fn is_ring(&self) -> bool {
        self.repeats && self.count == self.total
    }

    /// The place in the window, from 0, that is solved for; `None` for a frame that stays.
    pub fn solved(&self, place: i64) -> Option<usize> {
        let count = self.count as i64;
        match self.is_ring() {
            true => Some(place.rem_euclid(count) as usize),
            false => (0..count).contains(&place).then_some(place as usize),
        }
    }
}
