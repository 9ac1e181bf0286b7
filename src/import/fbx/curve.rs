//! Animation curves: values at, between and beyond the keys.

use super::key::{Beyond, Key, between, leaving_slope};
use super::keys::{beyond, keys, raw_keys};
use super::numbers::in_range;
use super::record::Element;

/// One animation curve. It has at least one key.
#[derive(Clone, Debug)]
pub(super) struct Curve {
    keys: Vec<Key>,
    before: Beyond,
    after: Beyond,
    /// Slope with which the curve arrives at its last key, units per tick.
    end_slope: f64,
    /// Whether keys were out of order or not finite.
    pub mended: bool,
}

impl Curve {
    /// Reads an `AnimationCurve`; `None` if it has no keys. `ticks` is ticks per second.
    pub fn read(
        record: &Element,
        ticks: f64,
        budget: &mut usize,
    ) -> Result<Option<Self>, &'static str> {
        let (mut raw, mut mended) = (raw_keys(record, budget)?, false);
        let count = raw.len();
        // Mend what can be mended: keys without a finite value are dropped, and keys out of order are sorted.
        raw.retain(|key| in_range(key.value));
        mended |= raw.len() != count;
        if !raw.is_sorted_by(|a, b| a.tick <= b.tick) {
            raw.sort_by(|a, b| a.tick.total_cmp(&b.tick));
            mended = true;
        }
        if raw.is_empty() {
            return Ok(None);
        }
        let (keys, end_slope) = keys(&raw, ticks);
        let beyond = |name| record.child(name).map_or(Beyond::Hold, beyond);
        let (before, after) = (beyond("Pre-Extrapolation"), beyond("Post-Extrapolation"));
        Ok(Some(Self {
            keys,
            before,
            after,
            end_slope,
            mended,
        }))
    }

    /// Number of keys.
    pub fn len(&self) -> usize {
        self.keys.len()
    }

    /// Ticks of the first and the last key.
    pub fn ends(&self) -> (f64, f64) {
        let tick = |key: Option<&Key>| key.map_or(0.0, |key| key.tick);
        (tick(self.keys.first()), tick(self.keys.last()))
    }

    /// Ticks between neighbouring keys.
    pub fn spacings(&self) -> impl Iterator<Item = f64> + '_ {
        self.keys.windows(2).map(|pair| pair[1].tick - pair[0].tick)
    }

    /// Whether the curve changes from `start` to `end`, in ticks, as far as its keys and its ends show.
    pub fn varies(&self, start: f64, end: f64) -> bool {
        let mut inside = self
            .keys
            .iter()
            .filter(|key| (start..=end).contains(&key.tick))
            .map(|key| key.value);
        let first = inside.next();
        inside.any(|value| Some(value) != first) || self.value(start) != self.value(end)
    }

    /// The curve's value at `tick`: degrees of a rotation, the file's units of a translation.
    pub fn value(&self, tick: f64) -> f64 {
        let [first, .., last] = self.keys.as_slice() else {
            return self.keys.first().map_or(0.0, |key| key.value);
        };
        // Before, after and between the keys the curve follows different rules.
        if tick < first.tick {
            self.beyond(self.before, first, self.start_slope(), tick)
        } else if tick > last.tick {
            self.beyond(self.after, last, self.end_slope, tick)
        } else {
            self.inside(tick)
        }
    }

    /// The value at a tick that isn't outside the keys.
    fn inside(&self, tick: f64) -> f64 {
        let at = self.segment_at(tick);
        let (Some(key), next) = (self.keys.get(at), self.keys.get(at + 1)) else {
            return 0.0;
        };
        match next {
            Some(next) if tick > key.tick => between(key, next, tick),
            _ => key.value,
        }
    }

    /// Index of the last key that isn't after `tick`. Baked curves have even keys, and there the guess is right at once.
    fn segment_at(&self, tick: f64) -> usize {
        let last = self.keys.len() - 1;
        let (start, end) = (self.keys[0].tick, self.keys[last].tick);
        let guess = (((tick - start) / (end - start) * last as f64) as usize).min(last);
        let holds = |at: usize| {
            self.keys[at].tick <= tick && self.keys.get(at + 1).is_none_or(|next| tick < next.tick)
        };
        if holds(guess) {
            return guess;
        }
        self.keys
            .partition_point(|key| key.tick <= tick)
            .saturating_sub(1)
    }

    /// The value at a tick outside the keys, next to the key `edge`, where the curve has `slope`.
    fn beyond(&self, beyond: Beyond, edge: &Key, slope: f64, tick: f64) -> f64 {
        match beyond {
            Beyond::Hold => edge.value,
            Beyond::Slope => edge.value + slope * (tick - edge.tick),
            Beyond::Cycle {
                repeats,
                mirror,
                climb,
            } => self.cycle(tick, repeats, mirror, climb),
        }
    }

    /// The value at a tick outside the keys, where the curve repeats. `turn` counts the repetitions before the one that the
    /// tick is in, starting at 0, and `rest` is how far into it the tick is. After the last repetition its end holds.
    fn cycle(&self, tick: f64, repeats: Option<f64>, mirror: bool, climb: bool) -> f64 {
        let [first, .., last] = self.keys.as_slice() else {
            return 0.0;
        };
        let length = last.tick - first.tick;
        let forward = tick > last.tick;
        let edge = if forward { last } else { first };
        // A curve shorter than a tick has nothing to repeat.
        if length < 1.0 || repeats == Some(0.0) {
            return edge.value;
        }
        let outside = if forward {
            tick - last.tick
        } else {
            first.tick - tick
        };
        let mut turn = (outside / length).floor();
        let mut rest = outside - turn * length;
        // Beyond the last repetition, its last value holds.
        if let Some(repeats) = repeats.filter(|&repeats| turn >= repeats) {
            (turn, rest) = (repeats - 1.0, length);
        }
        // The first repetition, number 0, runs backward, then every second one.
        if mirror && turn % 2.0 == 0.0 {
            rest = length - rest;
        }
        let from_start = if forward { rest } else { length - rest };
        // Each repetition starts from the end of the one before: the rise of all of them is added.
        let climbed = if climb {
            (last.value - first.value) * (turn + 1.0)
        } else {
            0.0
        };
        self.inside(first.tick + from_start) + if forward { climbed } else { -climbed }
    }

    /// Slope with which the curve leaves its first key, units per tick.
    fn start_slope(&self) -> f64 {
        match self.keys.as_slice() {
            [key, next, ..] => leaving_slope(key, next),
            _ => 0.0,
        }
    }
}
