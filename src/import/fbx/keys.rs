//! Keys of animation curves, from the file's arrays. The flags are those of `KeyAttrFlags`, as ufbx lists them.

use super::array::Array;
use super::key::{Beyond, Handle, Key, Segment, arriving_slope};
use super::record::Element;
use super::tangent::{Attribute, Step, TANGENT_USER, slopes};
use std::iter::repeat_n;

const CONSTANT: u32 = 0x2;
const CUBIC: u32 = 0x8;
const CONSTANT_NEXT: u32 = 0x100;
/// Attribute of keys in files that give none.
const LINEAR: Attribute = Attribute {
    flags: 0x4,
    data: [0; 4],
};

/// A key as the file has it.
pub(super) struct RawKey {
    /// Time, in ticks of the file's clock.
    pub tick: f64,
    pub value: f64,
    /// How the curve passes it.
    pub attribute: Attribute,
}

/// The keys in file order; none if the record has no arrays.
pub(super) fn raw_keys(record: &Element, budget: &mut usize) -> Result<Vec<RawKey>, &'static str> {
    let (Some(times), Some(values)) = (record.array("KeyTime"), record.array("KeyValueFloat"))
    else {
        return Ok(Vec::new());
    };
    let (times, values) = (times.integers(budget)?, values.reals(budget)?);
    if times.len() != values.len() {
        return Err("a curve has different numbers of times and values");
    }
    let attributes = attributes(record, times.len(), budget)?;
    let keys = times.into_iter().zip(values).zip(attributes);
    Ok(keys
        .map(|((time, value), attribute)| RawKey {
            tick: time as f64,
            value,
            attribute,
        })
        .collect())
}

/// One attribute per key, out of the file's run-length form.
fn attributes(
    record: &Element,
    count: usize,
    budget: &mut usize,
) -> Result<Vec<Attribute>, &'static str> {
    let find = |name| record.array(name).filter(|_| count > 0);
    let (Some(flags), Some(data), Some(runs)) = (
        find("KeyAttrFlags"),
        find("KeyAttrDataFloat"),
        find("KeyAttrRefCount"),
    ) else {
        return Ok(vec![LINEAR; count]);
    };
    let mut read = |array: Array| array.words(budget);
    let (flags, data, runs) = (read(flags)?, read(data)?, read(runs)?);
    if flags.len() != runs.len() || data.len() != 4 * runs.len() {
        return Err("a curve has different numbers of key attributes");
    }
    let runs =
        runs.iter()
            .zip(flags)
            .zip(data.chunks_exact(4))
            .flat_map(|((&run, flags), data)| {
                repeat_n(
                    Attribute {
                        flags,
                        data: [data[0], data[1], data[2], data[3]],
                    },
                    run as usize,
                )
            });
    let attributes: Vec<_> = runs.take(count).collect();
    if attributes.len() == count {
        Ok(attributes)
    } else {
        Err("a curve has too few key attributes")
    }
}

/// The keys, in order, with their segments, and the slope in units per tick with which the curve arrives at its last key. `ticks`
/// is ticks per second.
pub(super) fn keys(raw: &[RawKey], ticks: f64) -> (Vec<Key>, f64) {
    let sides: Vec<_> = (0..raw.len()).map(|i| sides(raw, i, ticks)).collect();
    let keys = raw.iter().enumerate().map(|(i, key)| {
        let arriving = sides.get(i + 1).map_or(0.0, |side| side.0);
        let next = raw.get(i + 1);
        let seconds = next.map_or(0.0, |next| (next.tick - key.tick) / ticks);
        let segment = segment(&key.attribute, sides[i].1, arriving, seconds);
        Key {
            tick: key.tick,
            value: key.value,
            segment,
        }
    });
    let keys: Vec<Key> = keys.collect();
    // The last key's own slope, where it has one, goes on beyond it; else that of the segment before it.
    let computes = raw
        .last()
        .is_some_and(|key| is_cubic(&key.attribute) && !key.attribute.has(TANGENT_USER));
    let end = match (keys.as_slice(), sides.last()) {
        (_, Some(side)) if computes => side.0 / ticks,
        ([.., key, next], _) => arriving_slope(key, next),
        _ => 0.0,
    };
    (keys, end)
}

/// Slopes of a key to its left and right, units per second.
fn sides(raw: &[RawKey], index: usize, ticks: f64) -> (f64, f64) {
    let step = |a: &RawKey, b: &RawKey, weight: f64| {
        // Two keys at one time are a jump, which has no slope.
        let time = (b.tick - a.tick) / ticks;
        (time > 0.0).then_some(Step {
            time,
            rise: b.value - a.value,
            weight,
        })
    };
    let own = &raw[index];
    let previous = index.checked_sub(1).map(|previous| &raw[previous]);
    let before = previous.and_then(|p| step(p, own, p.attribute.next_left_weight()));
    let after = raw
        .get(index + 1)
        .and_then(|next| step(own, next, own.attribute.right_weight()));
    slopes_of(own, previous, before, after)
}

/// A key that isn't cubic itself may still end a cubic segment, with the slope that the key before it states.
fn slopes_of(
    own: &RawKey,
    previous: Option<&RawKey>,
    before: Option<Step>,
    after: Option<Step>,
) -> (f64, f64) {
    let mut attribute = own.attribute;
    if !is_cubic(&attribute) {
        attribute.flags = TANGENT_USER;
    }
    slopes(before, after, previous.map(|key| key.attribute), attribute)
}

fn is_cubic(attribute: &Attribute) -> bool {
    attribute.has(CUBIC) && !attribute.has(CONSTANT)
}

/// The segment after a key that leaves it with the slope `leaving` and arrives with `arriving`, units per second, after
/// `seconds`.
fn segment(attribute: &Attribute, leaving: f64, arriving: f64, seconds: f64) -> Segment {
    if attribute.has(CONSTANT) {
        return if attribute.has(CONSTANT_NEXT) {
            Segment::HoldNext
        } else {
            Segment::Hold
        };
    }
    if !attribute.has(CUBIC) {
        return Segment::Line;
    }
    // A handle covers a fraction of the segment's time, and rises with its slope.
    let handle = |weight: f64, slope: f64| Handle {
        weight,
        rise: slope * weight * seconds,
    };
    Segment::Cubic {
        leave: handle(attribute.right_weight(), leaving),
        arrive: handle(attribute.next_left_weight(), arriving),
    }
}

/// What a `Pre-Extrapolation` or `Post-Extrapolation` record states.
pub(super) fn beyond(record: &Element) -> Beyond {
    // The type is one letter, stored as its character code.
    let kind = record
        .child("Type")
        .and_then(|kind| kind.int(0))
        .and_then(|code| u8::try_from(code).ok());
    let repeats = record.child("Repetition").and_then(|count| count.int(0));
    let repeats = repeats
        .filter(|&count| count >= 0)
        .map(|count| count as f64);
    let cycle = |mirror, climb| Beyond::Cycle {
        repeats,
        mirror,
        climb,
    };
    match kind {
        Some(b'K') => Beyond::Slope,
        Some(b'R') => cycle(false, false),
        Some(b'M') => cycle(true, false),
        Some(b'A') => cycle(false, true),
        _ => Beyond::Hold,
    }
}
