//! Takes: their time span, frame rate, and what they move.

use super::animation::Animation;
use super::curve::Curve;
use super::document::Document;
use super::properties::Properties;
use super::record::Element;
use crate::clip::Problem;
use crate::import::measure::whole_rate;
use crate::import::scene::Take;
use std::collections::BTreeMap;

/// Longest take, seconds. Chosen: longer spans come from markers that nobody set.
const MAX_SECONDS: f64 = 6.0 * 3600.0;
/// Rate of takes whose file and keys say nothing, Hz. Chosen.
const FALLBACK_FPS: f64 = 30.0;

/// Start and stop in ticks, as the file's list of takes states them: of the take itself, and of its reference.
#[derive(Default)]
pub(super) struct Span {
    local: Option<(i64, i64)>,
    reference: Option<(i64, i64)>,
}

/// The list of takes, by name. Old writers state a take's times only there.
pub(super) fn spans(document: &Document) -> BTreeMap<String, Span> {
    let list = document
        .record("Takes")
        .map_or(&[][..], |list| &list.children);
    let span = |take: &Element| {
        let times = |name| {
            let times = take.child(name)?;
            Some((times.int(0)?, times.int(1)?))
        };
        let name = String::from_utf8_lossy(take.text(0)?).into_owned();
        let (local, reference) = (times("LocalTime"), times("ReferenceTime"));
        Some((name, Span { local, reference }))
    };
    let takes = list.iter().filter(|take| take.name == b"Take");
    takes.filter_map(span).collect()
}

/// What a file states about a take's time.
pub(super) struct Stated<'s, 'd, 'a> {
    /// Those of the animation stack.
    pub properties: Properties<'s, 'd, 'a>,
    /// What the list of takes states.
    pub listed: Option<&'s Span>,
    /// Ticks per second.
    pub ticks: f64,
    /// Frame rate, Hz, if stated.
    pub fps: Option<f64>,
}

/// The take of an animation.
pub(super) fn take(name: &str, stated: &Stated, animation: &Animation, curves: &[Curve]) -> Take {
    let (ticks, keyed) = (stated.ticks, key_range(animation, curves));
    let (start, end) = span(stated, keyed);
    let moves = |node: &usize| {
        let mut own = curves_of(animation, *node, curves);
        own.any(|curve| curve.varies((start * ticks).round(), (end * ticks).round()))
    };
    let animated = animation.nodes().filter(moves).collect();
    let spacings = all_curves(animation, curves).flat_map(Curve::spacings);
    let fps = rate(stated.fps, spacings, ticks);
    let mut take = Take {
        name: name.into(),
        start,
        end,
        fps,
        animated,
        wraps: None,
        channels: animation.size(),
        problems: Vec::new(),
        fault: None,
    };
    take.problems = problems(&take, animation, curves);
    let keyed = keyed.map(|(first, last)| (first / ticks, last / ticks));
    take.problems.extend(span_problems(&take, keyed));
    take
}

fn curves_of<'a>(
    animation: &'a Animation,
    node: usize,
    curves: &'a [Curve],
) -> impl Iterator<Item = &'a Curve> {
    let used = animation
        .channels(node)
        .iter()
        .flat_map(|channel| channel.curves)
        .flatten();
    used.filter_map(|curve| curves.get(curve))
}

fn all_curves<'a>(
    animation: &'a Animation,
    curves: &'a [Curve],
) -> impl Iterator<Item = &'a Curve> {
    animation
        .nodes()
        .flat_map(move |node| curves_of(animation, node, curves))
}

/// First and last tick of all curves that drive nodes.
fn key_range(animation: &Animation, curves: &[Curve]) -> Option<(f64, f64)> {
    let ends = all_curves(animation, curves).map(Curve::ends);
    ends.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

/// Start and end in seconds: the take's own span, else its reference span, else the span of its keys.
fn span(take: &Stated, keyed: Option<(f64, f64)>) -> (f64, f64) {
    let (properties, ticks) = (&take.properties, take.ticks);
    let stated = |start, stop, listed: Option<(i64, i64)>| {
        // A stated stop without a start begins at 0.
        let own = properties.int(stop);
        let own = own.map(|stop| (properties.int(start).unwrap_or(0), stop));
        let (start, stop) = own.or(listed)?;
        let (start, stop) = (start as f64 / ticks, stop as f64 / ticks);
        (stop > start).then_some((start, stop))
    };
    let listed = take.listed;
    let spans = [
        stated("LocalStart", "LocalStop", listed.and_then(|s| s.local)),
        stated(
            "ReferenceStart",
            "ReferenceStop",
            listed.and_then(|s| s.reference),
        ),
        keyed.map(|(first, last)| (first / ticks, last / ticks)),
    ];
    first_sane(&spans)
}

/// The first of `spans` that isn't too long. If all are, the beginning of the last one, which is that of the keys.
pub(super) fn first_sane(spans: &[Option<(f64, f64)>]) -> (f64, f64) {
    let sane = |(start, end): &&(f64, f64)| end - start <= MAX_SECONDS;
    let keyed = spans.last().copied().flatten();
    let cut = || keyed.map(|(start, _)| (start, start + MAX_SECONDS));
    let whole = spans.iter().flatten().find(sane).copied();
    whole.or_else(cut).unwrap_or((0.0, 0.0))
}

/// Frame rate, Hz: the one that the file states, else that of its keys, else 30. `spacings` of keys are in ticks.
pub(super) fn rate(stated: Option<f64>, spacings: impl Iterator<Item = f64>, ticks: f64) -> f64 {
    stated.unwrap_or_else(|| spacing_fps(spacings, ticks).unwrap_or(FALLBACK_FPS))
}

/// Frame rate of the keys' most common spacing; of equally common ones, the fastest.
fn spacing_fps(spacings: impl Iterator<Item = f64>, ticks: f64) -> Option<f64> {
    let mut counts = BTreeMap::<u64, usize>::new();
    // Baked curves have a key per frame: the most common spacing is a frame.
    for spacing in spacings.filter(|&spacing| spacing >= 1.0) {
        *counts.entry(spacing as u64).or_default() += 1;
    }
    let (spacing, _) = counts
        .into_iter()
        .max_by_key(|&(spacing, count)| (count, std::cmp::Reverse(spacing)))?;
    let fps = whole_rate(ticks / spacing as f64);
    (1.0..=1000.0).contains(&fps).then_some(fps)
}

/// Problems with the curves and layers of a take.
fn problems(take: &Take, animation: &Animation, curves: &[Curve]) -> Vec<Problem> {
    let mut problems = Vec::new();
    if all_curves(animation, curves).any(|curve| curve.mended) {
        problems.push(Problem::warning(
            "mended-curves",
            format!(
                "take `{}` has curves with keys out of order or without a finite value",
                take.name
            ),
        ));
    }
    if animation.silent() > 0 {
        let (silent, name) = (animation.silent(), &take.name);
        let message = format!("take `{name}` has {silent} muted layers, which are left out");
        problems.push(Problem::note("muted-layers", message));
    }
    problems
}

/// Problems with the span of a take. `keyed` is the span of its keys, seconds.
pub(super) fn span_problems(take: &Take, keyed: Option<(f64, f64)>) -> Vec<Problem> {
    let mut problems = Vec::new();
    let mut note = |id, message: String| problems.push(Problem::note(id, message));
    if take.animated.is_empty() {
        note("empty-take", format!("take `{}` moves nothing", take.name));
    }
    if take.end - take.start == MAX_SECONDS {
        note(
            "cut-take",
            format!("take `{}` was cut to its first six hours", take.name),
        );
    } else if let Some((first, last)) = keyed {
        // Keys up to a frame outside come from rounding.
        let frame = 1.0 / take.fps;
        if first < take.start - frame || last > take.end + frame {
            note(
                "keys-outside-take",
                format!(
                    "take `{}` lasts from {:.3} to {:.3} s and its keys from {first:.3} to {last:.3} s: keys outside the take are left out",
                    take.name, take.start, take.end
                ),
            );
        }
    }
    problems
}
