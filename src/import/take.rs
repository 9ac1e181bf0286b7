//! Which take of a file to read: the one that was asked for, or the one with the most motion.

use super::error::ErrorKind;
use super::names::first_few;
use super::scene::Scene;
use crate::clip::Problem;
use crate::explain::meant;
use nalgebra::Matrix4;

/// At how many times a take is evaluated to see whether anything moves in it. Chosen: a motion that is the same pose at nine
/// uneven times is none.
const LOOKS: usize = 9;
/// The k-th time is at the fraction of k · (√5 − 1) / 2 of the take: multiples of the golden ratio never meet the same phase
/// of any number of equal cycles, as even times would.
const UNEVEN: f64 = 0.618_033_988_749_894_8;

/// Most nodes that are placed to compare takes. In a file with more, what has curves counts as moving. Chosen, so
/// that a small file can't make the comparison take minutes.
const MOST_PLACEMENTS: usize = 1 << 22;

/// The take called `wanted` (its name, its name in other letter case, its name behind a `|`, or its number
/// counted from 1), or the one with most motion, with a note when there was a choice.
pub(crate) fn choose(
    scene: &dyn Scene,
    wanted: Option<&str>,
) -> Result<(usize, Option<Problem>), ErrorKind> {
    if scene.takes().is_empty() {
        return Err(ErrorKind::NoTakes(scene.contents().no_takes));
    }
    let unknown = |wanted: &str| ErrorKind::UnknownTake {
        wanted: wanted.to_owned(),
        count: scene.takes().len(),
        takes: match scene.takes() {
            [only] => format!("`{}`, the only one", only.name),
            _ => format!("one of {}", list(scene)),
        },
        meant: meant(wanted, scene.takes().iter().map(|take| &take.name))
            .map(|name| short(scene, &name).to_owned()),
    };
    let (take, note) = match wanted {
        Some(wanted) => (find(scene, wanted).ok_or_else(|| unknown(wanted))?, None),
        None => {
            let take = most_motion(scene);
            (take, (scene.takes().len() > 1).then(|| note(scene, take)))
        }
    };
    match &scene.takes()[take].fault {
        Some(fault) => Err(ErrorKind::Malformed(fault.clone())),
        None => Ok((take, note)),
    }
}

fn find(scene: &dyn Scene, wanted: &str) -> Option<usize> {
    let same = |a: &str, b: &str| a.to_lowercase() == b.to_lowercase();
    let only = |fits: &dyn Fn(&str) -> bool| {
        let mut found = scene
            .takes()
            .iter()
            .enumerate()
            .filter(|(_, take)| fits(&take.name));
        found
            .next()
            .filter(|_| found.next().is_none())
            .map(|(at, _)| at)
    };
    // From exact to lenient: the name, its letters, what follows an armature's name, and the number.
    let exact = scene.takes().iter().position(|take| take.name == wanted);
    exact
        .or_else(|| only(&|name| same(name, wanted)))
        .or_else(|| {
            only(&|name| {
                name.rsplit('|')
                    .next()
                    .is_some_and(|last| same(last, wanted))
            })
        })
        .or_else(|| {
            let number: usize = wanted.parse().ok()?;
            number.checked_sub(1).filter(|&at| at < scene.takes().len())
        })
}

/// What follows an armature's name, if it means the take alone: a shell takes a `|` for a command of its own.
fn short<'a>(scene: &dyn Scene, name: &'a str) -> &'a str {
    let last = name.rsplit('|').next().unwrap_or(name);
    let whole = scene.takes().iter().position(|take| take.name == name);
    match find(scene, last) {
        found if found.is_some() && found == whole => last,
        _ => name,
    }
}

fn list(scene: &dyn Scene) -> String {
    let takes = scene.takes().iter().enumerate();
    first_few(takes.map(|(at, take)| format!("{} `{}`", at + 1, take.name)))
}

/// The take in which most nodes move for longest; the first of equals.
pub(crate) fn most_motion(scene: &dyn Scene) -> usize {
    if scene.takes().len() == 1 {
        return 0;
    }
    let amounts = (0..scene.takes().len()).map(|take| amount(scene, take));
    let best = amounts.enumerate().fold((0, -1.0), |best, (take, amount)| {
        if amount > best.1 {
            (take, amount)
        } else {
            best
        }
    });
    best.0
}

/// Animated nodes × seconds: zero for a take in which nothing moves at the times that are evaluated, and −1 for one that
/// can't be used.
fn amount(scene: &dyn Scene, take: usize) -> f64 {
    let Some(about) = scene.takes().get(take) else {
        return 0.0;
    };
    if about.fault.is_some() {
        return -1.0;
    }
    let span = about.end - about.start;
    if about.animated.is_empty() || span <= 0.0 {
        return 0.0;
    }
    let all = about.animated.len() as f64 * span;
    let placements = scene.takes().len().saturating_mul(scene.nodes().len());
    if placements > MOST_PLACEMENTS / LOOKS {
        return all;
    }
    let look = |k: usize| {
        let part = (k as f64 * UNEVEN).fract();
        scene.world(Some((take, about.start + span * part)))
    };
    let first = look(0);
    // Distances count relative to the scene's size, so that units don't matter.
    let size = first
        .iter()
        .map(|m| m.fixed_view::<3, 1>(0, 3).norm())
        .fold(0.0, f64::max);
    let moves = (1..LOOKS).any(|k| differ(&first, &look(k), 1e-6 * size.max(1e-9)));
    if moves { all } else { 0.0 }
}

/// Whether some node moved by more than `shift`, or its axes changed by more than a millionth of their length: sixteen times
/// the rounding of the 32-bit numbers in files.
fn differ(a: &[Matrix4<f64>], b: &[Matrix4<f64>], shift: f64) -> bool {
    let moved = |(a, b): (&Matrix4<f64>, &Matrix4<f64>)| {
        let change = b - a;
        let turned =
            change.fixed_view::<3, 3>(0, 0).norm() > 1e-6 * a.fixed_view::<3, 3>(0, 0).norm();
        turned || change.fixed_view::<3, 1>(0, 3).norm() > shift
    };
    a.iter().zip(b).any(moved)
}

fn note(scene: &dyn Scene, take: usize) -> Problem {
    let name = scene
        .takes()
        .get(take)
        .map_or("", |take| take.name.as_str());
    Problem::note(
        "several-takes",
        format!(
            "chose take `{name}`, which has the most motion, from {}",
            list(scene)
        ),
    )
}
