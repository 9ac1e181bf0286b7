//! The field's metrics of tracking, over the frames of episodes; formulas as in DeepMimic (Peng et al. 2018) and PHC (Luo et
//! al. 2023). Means are over all frames of all episodes, the one that shows a failure included.

use crate::motion::skate;
use crate::sim::{Link, LinkState};
use crate::skeleton::Twist;
use crate::task::episode::{Episode, Frame, Good, Measure, Unit, mean};
use crate::task::model::CharacterModel;
use crate::task::step::{ReferenceState, StartState};
use nalgebra::Vector3;

// What is good enough is what docs/results.md asks of skills, and what all skills there reach.

/// Share of the episodes that last: asked of the cartwheel, the backflips, and eight clips in one policy. Of simpler skills
/// all of them was asked.
const SUCCESS: f64 = 0.95;
/// Local error, mm: asked of kicks, punch and jump. Of gaits 35 was asked, of flips 70. All skills there are below 36.
const LOCAL_MM: f64 = 50.0;
/// Global error, mm: nothing was asked. All skills there are below 98.
const GLOBAL_MM: f64 = 100.0;

/// Angular momentum that is none, kg·m²/s: no error is measured as a share of it. Chosen: a person who turns by a thousandth of
/// a radian per second has about as much.
const NO_MOMENTUM: f32 = 1e-3;

/// Measures episodes of one case, whose frames have flags of these `contact_bodies` of the model. `largest_momentum` is the
/// largest angular momentum of its reference, kg·m²/s.
pub fn measures(
    model: &CharacterModel,
    contact_bodies: &[usize],
    largest_momentum: f32,
    episodes: &[Episode],
) -> Vec<Measure> {
    let mut all = success(model, episodes).to_vec();
    all.extend(errors_of_frames(model, largest_momentum, episodes));
    all.extend(contacts(model, contact_bodies, episodes));
    all.extend(turning(episodes));
    all
}

/// Shares of the episodes that fail neither by a fall nor by a mean body error above 0.5 m, and of those among them whose
/// largest body error never exceeds 0.25 m.
fn success(model: &CharacterModel, episodes: &[Episode]) -> [Measure; 2] {
    let share = |holds: &dyn Fn(&Episode) -> bool| {
        let one = |e: &Episode| f64::from(u8::from(e.failure.is_none() && holds(e)));
        mean(episodes.iter().map(one))
    };
    let within = |e: &Episode| {
        pairs(e).all(|(frame, reference)| {
            errors(model, frame, reference, false).all(|error| error <= 0.25)
        })
    };
    [
        Measure::new(
            "success_mean_0_5",
            "success, mean error below 0.5 m",
            share(&|_| true),
        )
        .good(Good::High, Unit::Share)
        .enough(SUCCESS)
        .holding_disturbed(),
        Measure::new(
            "success_max_0_25",
            "success, no error above 0.25 m",
            share(&within),
        )
        .good(Good::High, Unit::Share),
    ]
}

/// How far body positions are from the reference, in the world and with each skeleton's root position subtracted (without
/// rotation alignment); how far velocities of link origins, centres of mass and angular momenta are: mean‖L − L̂‖ / max‖L̂‖,
/// which is not defined where nothing turns in the reference.
fn errors_of_frames(
    model: &CharacterModel,
    largest_momentum: f32,
    episodes: &[Episode],
) -> [Measure; 5] {
    let per_frame = |value: &dyn Fn(&Frame, &ReferenceState) -> f64| {
        let pairs = episodes.iter().flat_map(pairs);
        mean(pairs.map(|(frame, reference)| value(frame, reference)))
    };
    let body = |local| 1e3 * per_frame(&|f, r| mean(errors(model, f, r, local)));
    let center =
        |f: &Frame, r: &ReferenceState| f64::from((f.dynamics.com - r.dynamics.com).norm());
    let momentum = |f: &Frame, r: &ReferenceState| {
        f64::from((f.dynamics.angular_momentum - r.dynamics.angular_momentum).norm())
    };
    let momentum = match largest_momentum > NO_MOMENTUM {
        true => per_frame(&momentum) / f64::from(largest_momentum),
        false => f64::NAN,
    };
    [
        Measure::new("mpjpe_global_mm", "body error, global", body(false))
            .good(Good::Low, Unit::Millimeters)
            .enough(GLOBAL_MM)
            .holding_disturbed(),
        Measure::new("mpjpe_local_mm", "body error, root subtracted", body(true))
            .good(Good::Low, Unit::Millimeters)
            .enough(LOCAL_MM)
            .holding_disturbed(),
        Measure::new(
            "velocity_error_m_s",
            "velocity error",
            per_frame(&velocity_error),
        )
        .good(Good::Low, Unit::MetersPerSecond),
        Measure::new("com_error_m", "centre of mass error", per_frame(&center))
            .good(Good::Low, Unit::Meters),
        Measure::new("angular_momentum_error", "angular momentum error", momentum)
            .good(Good::Low, Unit::Share),
    ]
}

/// How well contacts with the ground agree with the reference's, and how fast what stands on the ground slides along it.
fn contacts(model: &CharacterModel, bodies: &[usize], episodes: &[Episode]) -> [Measure; 2] {
    [
        Measure::new("contact_f1", "contact F1", contact_f1(episodes))
            .good(Good::High, Unit::Score),
        Measure::new(
            "foot_skate_m_s",
            "foot skate",
            foot_skate(model, bodies, episodes),
        )
        .good(Good::Low, Unit::MetersPerSecond),
    ]
}

/// How far the roots of agent and reference turn in the episode that begins at the first frame, about the axis about which
/// the reference turns most: whether a somersault went all the way round.
fn turning(episodes: &[Episode]) -> [Measure; 2] {
    let from_start = |value: &dyn Fn(&Episode) -> f64| {
        let first = |e: &&Episode| e.start.state == StartState::Reference(0.0);
        mean(episodes.iter().filter(first).map(value))
    };
    let agent = from_start(&|e| turned(e, |frame, _| &frame.agent[0]));
    let reference = from_start(&|e| turned(e, |_, reference| &reference.links[0]));
    [
        Measure::new("root_rotation_turned_rad", "root turned", agent)
            .good(Good::Near(reference), Unit::Radians),
        Measure::new(
            "root_rotation_reference_rad",
            "root turned by the reference",
            reference,
        )
        .good(Good::Neither, Unit::Radians),
    ]
}

/// The frames of an episode with the reference of each.
fn pairs(episode: &Episode) -> impl Iterator<Item = (&Frame, &ReferenceState)> {
    let frames = episode.frames.iter();
    frames.filter_map(|frame| Some((frame, frame.reference.as_ref()?)))
}

/// Distance of each body from the reference's, metres; `local` takes each skeleton's root position off.
fn errors<'a>(
    model: &'a CharacterModel,
    frame: &'a Frame,
    reference: &'a ReferenceState,
    local: bool,
) -> impl Iterator<Item = f64> + 'a {
    let (a, b) = (&frame.agent, &reference.links);
    let shift = if local {
        a[0].pose.translation.vector - b[0].pose.translation.vector
    } else {
        Vector3::zeros()
    };
    model
        .positions(a)
        .zip(model.positions(b))
        .map(move |(p, q)| f64::from((p - q - shift).norm()))
}

/// Mean difference of the velocities of link origins, m/s.
fn velocity_error(frame: &Frame, reference: &ReferenceState) -> f64 {
    let links = frame.agent.iter().zip(&reference.links);
    mean(links.map(|(a, b)| f64::from((a.linear - b.linear).norm())))
}

/// 2PR/(P + R) of contact body × frame, with precision P and recall R.
fn contact_f1(episodes: &[Episode]) -> f64 {
    let (mut both, mut either) = (0usize, 0usize);
    for (frame, reference) in episodes.iter().flat_map(pairs) {
        for (mine, wanted) in frame.contacts.iter().zip(&reference.contacts) {
            both += usize::from(*mine && *wanted);
            either += usize::from(*mine) + usize::from(*wanted);
        }
    }
    // 2PR/(P + R) = 2·TP / (TP + FP + TP + FN).
    if either == 0 {
        1.0
    } else {
        2.0 * both as f64 / either as f64
    }
}

/// Mean horizontal speed of a foot or hand on the ground while it presses on it, m/s; see [`skate::sole_speed`]. Where several
/// bodies of a link press, the link counts for each.
fn foot_skate(model: &CharacterModel, bodies: &[usize], episodes: &[Episode]) -> f64 {
    mean(episodes.iter().flat_map(|e| &e.frames).flat_map(|frame| {
        let contacts = bodies.iter().map(|&c| &model.contacts[c]);
        let standing = contacts.zip(&frame.contacts);
        let standing = standing.filter(|(contact, on)| **on && contact.is_end);
        standing.map(move |(contact, _)| {
            let link = contact.link;
            sole_speed(&model.character.links[link], &frame.agent[link])
        })
    }))
}

/// Horizontal speed of a link's sole, m/s.
fn sole_speed(link: &Link, state: &LinkState) -> f64 {
    let twist = Twist {
        linear: state.linear.cast(),
        angular: state.angular.cast(),
    };
    skate::sole_speed(&link.shapes, &state.pose.cast(), &twist)
}

/// Angle that a root turned about the axis of the reference's own net turning, each in its own frame, radians.
fn turned(
    episode: &Episode,
    root: impl for<'a> Fn(&'a Frame, &'a ReferenceState) -> &'a LinkState,
) -> f64 {
    let spin = |state: &LinkState| {
        state
            .pose
            .rotation
            .inverse_transform_vector(&state.angular)
            .cast::<f64>()
    };
    let net: Vector3<f64> = pairs(episode).map(|(_, r)| spin(&r.links[0])).sum();
    let axis = net.try_normalize(1e-9).unwrap_or_else(Vector3::z);
    let turning = pairs(episode).map(|(f, r)| spin(root(f, r)).dot(&axis));
    turning.sum::<f64>() / episode.control_hz
}
