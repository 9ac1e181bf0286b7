//! Stage 3, placement: moves goals and source so that the ground is z = 0 and the root starts above the origin, and
//! places hands and feet on it.
//!
//! In this order, for each step needs the one before: a clip that walks on the spot gets its travel back; the ground is
//! found under the feet; hands go down to it where the source's do; and feet that are high above it hang on the skeleton's
//! own legs.

mod ground;
mod hands;
mod nailed;
mod swing;
mod travel;

use super::anchor::SourceContact;
use super::end_effector::{end_effectors, soles};
use super::goals::Goals;
use super::limbs::HANDS;
use super::model::Model;
use super::pose::Posed;
use super::rotation::heading;
use super::seam::STRAIGHT;
use super::setting::Setting;
use super::source::Source;
use crate::clip::{LoopMode, Problem};
use ground::{Ground, Points};
use nailed::Nailed;
use nalgebra::Vector3;

/// Goals and source on the ground.
pub(super) struct Placed {
    /// What the skeleton should look like.
    pub goals: Goals,
    /// What the result will be measured against; it stands where the goals do.
    pub source: Source,
    /// When the source's feet and hands are on the ground.
    pub contacts: Vec<SourceContact>,
    /// The warnings `travel-restored` and `hips-restored`.
    pub problems: Vec<Problem>,
}

/// Puts goals and source on the ground.
///
/// `first` is the frame in which the root is above the origin.
pub(super) fn place(posed: Posed, model: &Model, setting: &Setting, first: usize) -> Placed {
    let (posed, problems) = with_travel(posed, model, setting);
    let ground = find_ground(&posed, model, setting);
    let contacts = posed.source.contacts(ground.floor, setting);
    let Posed { goals, source } = posed;
    let goals = with_hands_down(goals, &source, &contacts, &ground, setting.fps);
    let posed = at_origin(Posed { goals, source }, &ground, first);
    Placed {
        goals: swing::on_own_legs(posed.goals, setting.ankle, setting.leg),
        source: posed.source,
        contacts,
        problems,
    }
}

/// Gives a clip that walks on the spot the travel that its sliding feet show, and one whose hips are nailed the way that they
/// lost, with warnings.
fn with_travel(posed: Posed, model: &Model, setting: &Setting) -> (Posed, Vec<Problem>) {
    if nailed::is_nailed(&posed.source, setting.leg) {
        return with_lost_way(posed, model, setting);
    }
    let travel = travel::missing(&posed.goals, model, setting, false);
    let problems = travel.as_ref().map(travel::problem).into_iter().collect();
    let by = travelled(travel.unwrap_or_default(), setting);
    (shifted(posed, by), problems)
}

/// Gives nailed hips their way up and down, their travel, and the rest of their way over the ground.
fn with_lost_way(posed: Posed, model: &Model, setting: &Setting) -> (Posed, Vec<Problem>) {
    let com = |qpos: &Vec<f64>| model.skeleton.com(&model.skeleton.forward(qpos));
    let com: Vec<_> = posed.goals.guess.iter().map(com).collect();
    let points = ground_points(model, &posed.goals);
    let nailed = Nailed {
        com: &com,
        points: &points,
        repeats: repeats(&posed.goals, setting),
        setting,
    };
    let down = nailed.down(lift(&posed, setting).unwrap_or(0.0));
    let as_it_is = travel::missing(&posed.goals, model, setting, true);
    let posed = shifted(posed, |f| down[f]);
    // Feet may slide only once they have come down.
    let travel = as_it_is.or_else(|| travel::missing(&posed.goals, model, setting, true));
    let mut problems: Vec<Problem> = travel.as_ref().map(travel::problem).into_iter().collect();
    let travel = travel.unwrap_or_default();
    let mut way = nailed.over_ground(&travel);
    if !nailed::is_seen(&way, setting.leg) {
        way.fill(Vector3::zeros());
    }
    let whole: Vec<_> = way.iter().zip(&down).map(|(a, b)| a + b).collect();
    if nailed::is_seen(&whole, setting.leg) {
        problems.push(nailed::problem(&whole));
    }
    let travelled = travelled(travel, setting);
    (shifted(posed, |f| way[f] + travelled(f)), problems)
}

/// Whether the clip's cycles all go in the same direction.
fn repeats(goals: &Goals, setting: &Setting) -> bool {
    let last = goals.frames() - 1;
    let turn = goals.root_rotation(last) * goals.root_rotation(0).inverse();
    setting.loop_mode == LoopMode::Wrap && heading(&turn).abs() < STRAIGHT
}

/// Where this travel, m/s, leads by each frame, metres: from the first frame on, so that the clip starts where it did.
fn travelled(travel: Vector3<f64>, setting: &Setting) -> impl Fn(usize) -> Vector3<f64> {
    let fps = setting.fps;
    move |f| travel * (f as f64 / fps)
}

/// Goals and source with every frame shifted, metres.
fn shifted(posed: Posed, by: impl Fn(usize) -> Vector3<f64>) -> Posed {
    let Posed {
        mut goals,
        mut source,
    } = posed;
    for f in 0..goals.frames() {
        goals.shift_frame(f, &by(f));
        source.shift_frame(f, &by(f));
    }
    Posed { goals, source }
}

/// Finds the ground under the goals.
fn find_ground(posed: &Posed, model: &Model, setting: &Setting) -> Ground {
    let points = ground_points(model, &posed.goals);
    ground::find(&points, lift(posed, setting), setting)
}

/// How much higher than the source's soles the skeleton's are, metres, where the source's rest pose tells: ankles are at the
/// source's height, so soles differ by how much higher its ankles are above its soles.
fn lift(posed: &Posed, setting: &Setting) -> Option<f64> {
    posed.source.ankle.map(|height| height - setting.ankle)
}

/// The lowest points of the feet as their goals turn them, and of the whole body as guessed.
fn ground_points(model: &Model, goals: &Goals) -> Points {
    let soles = soles(model, goals);
    let feet = end_effectors(model, goals).into_iter();
    // Feet are turned as their goals say, the rest of the body is as guessed.
    let in_feet: Vec<usize> = feet.filter(|e| e.is_foot).flat_map(|e| e.points).collect();
    let others = |k: &usize| !in_feet.contains(k);
    let others: Vec<usize> = (0..model.contact_points.len()).filter(others).collect();
    let mut pose = model.empty_pose();
    let all = |(qpos, soles): (&Vec<f64>, &Vec<Vector3<f64>>)| {
        model.evaluate(qpos, &mut pose);
        let place = |k: &usize| {
            let point = &model.contact_points[*k];
            point.place(&pose.bodies) - Vector3::z() * point.radius
        };
        soles
            .iter()
            .copied()
            .chain(others.iter().map(place))
            .collect()
    };
    let all = goals.guess.iter().zip(&soles).map(all).collect();
    Points { soles, all }
}

/// Moves hands to where the source puts them down.
fn with_hands_down(
    goals: Goals,
    source: &Source,
    contacts: &[SourceContact],
    ground: &Ground,
    fps: f64,
) -> Goals {
    let hands = contacts.iter().filter(|c| HANDS.contains(&c.slot));
    hands.fold(goals, |goals, hand| {
        hands::set_down(goals, source, hand, ground, fps)
    })
}

/// Moves everything to where the ground is z = 0 and the root is above the origin in frame `first`.
fn at_origin(posed: Posed, ground: &Ground, first: usize) -> Posed {
    let root = posed.goals.root(first);
    let home = Vector3::new(-root.x, -root.y, -ground.floor - ground.lift);
    shifted(posed, |_| home)
}
