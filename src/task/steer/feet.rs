//! Feet that stay where they stand, and step when the body has gone on.

use super::leg::Leg;
use super::pose::{Pose, Tree};
use super::space::apart;
use super::spring::Spring;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector2, Vector3};

// All chosen.

/// Height to which a foot is raised in a step that is all stepping and no gait, metres.
const CLEARANCE: f32 = 0.05;
/// Share of a swing after which the foot is led down to the ground.
const LANDS: f32 = 0.6;
/// Farthest that a foot comes down turned ahead of the trunk, radians.
const FARTHEST_LEAD: f32 = 0.5;
/// How much the pelvis is lowered at most so that a leg is long enough, metres.
const DEEPEST: f32 = 0.12;
/// Time constant of that, s.
const SINKS_S: f32 = 0.05;
/// Distance (m) and turn (rad) from where feet of a standing body belong: within, they stay; beyond, it steps.
const NEAR: [f32; 2] = [0.04, 0.2];
const FAR: [f32; 2] = [0.15, 0.6];

/// Where a foot is against where its gait has it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Offset {
    /// Along the ground, metres.
    shift: Vector2<f32>,
    /// About the vertical, radians.
    turn: f32,
    /// Upward, metres.
    lift: f32,
}

/// A foot.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Foot {
    stands: bool,
    offset: Offset,
    /// The offset with which it left the ground.
    left_with: Offset,
    /// The direction to which it points while it stands, radians.
    heading: f32,
    /// World from foot, as last placed.
    pose: Isometry3<f32>,
}

/// Both feet, left and right.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Feet {
    feet: [Foot; 2],
    /// How much lower the pelvis is than its gait has it, so that the legs are long enough, metres.
    down: Spring<f32>,
}

/// What a step of the feet needs to know.
pub(super) struct Step {
    /// Phase of the gait.
    pub phase: f32,
    /// Whether the character steps at all.
    pub steps: bool,
    /// Share of the cycle in which each foot stands.
    pub stance: [f32; 2],
    /// How much of a gait it is, 0 to 1.
    pub size: f32,
    /// The frame that travels with the character.
    pub root: Isometry3<f32>,
    /// Seconds since the step before.
    pub dt: f32,
    /// How far the trunk will have turned in the middle of a stance, radians.
    pub lead: f32,
}

/// How far the feet are from where a standing body has them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Off {
    /// Both are near enough to stay.
    pub near: bool,
    /// One is so far that it has to step.
    pub far: bool,
    /// The larger turn, radians.
    pub turn: f32,
}

impl Default for Foot {
    fn default() -> Self {
        Foot {
            stands: true,
            offset: Offset::default(),
            left_with: Offset::default(),
            heading: 0.0,
            pose: Isometry3::identity(),
        }
    }
}

impl Feet {
    /// Feet that stand as they are in this pose.
    pub fn standing(legs: &[Leg; 2], links: &[Isometry3<f32>]) -> Feet {
        let foot = |i: usize| {
            let pose = links[legs[i].foot];
            Foot {
                heading: legs[i].heading(&pose.rotation),
                pose,
                ..Foot::default()
            }
        };
        Feet {
            feet: [foot(0), foot(1)],
            ..Feet::default()
        }
    }

    /// Moves them along the ground, metres.
    pub fn shift(&mut self, by: &Vector2<f32>) {
        for foot in &mut self.feet {
            foot.pose.translation.vector += by.push(0.0);
        }
    }

    /// Whether both are on the ground.
    pub fn both_stand(&self) -> bool {
        self.feet.iter().all(|foot| foot.stands)
    }

    /// Whether each is on the ground.
    pub fn stand(&self) -> [bool; 2] {
        self.feet.map(|foot| foot.stands)
    }

    /// How far they are from where the links of a standing pose have them.
    pub fn off(&self, legs: &[Leg; 2], links: &[Isometry3<f32>]) -> Off {
        let offs = [0, 1].map(|i| {
            let (foot, wanted) = (&self.feet[i].pose, &links[legs[i].foot]);
            let apart_by = (foot.translation.vector - wanted.translation.vector).xy();
            let [own, other] = [foot, wanted].map(|pose| legs[i].heading(&pose.rotation));
            (apart_by.norm(), apart(other, own))
        });
        let within = |[far, turn]: [f32; 2]| {
            offs.iter()
                .all(|(by, angle)| *by < far && angle.abs() < turn)
        };
        let turn = offs.iter().map(|off| off.1);
        Off {
            near: within(NEAR),
            far: !within(FAR),
            turn: turn
                .max_by(|a, b| a.abs().total_cmp(&b.abs()))
                .unwrap_or(0.0),
        }
    }

    /// Moves the feet on, and bends the legs of `pose` so that they are there. `links` are those of `pose` before and after.
    pub fn place(
        &mut self,
        step: &Step,
        legs: &[Leg; 2],
        tree: &Tree,
        pose: &mut Pose,
        links: &mut [Isometry3<f32>],
    ) {
        for (i, leg) in legs.iter().enumerate() {
            self.feet[i].go_on(i, step, leg, &links[leg.foot]);
        }
        // The pelvis goes down where a leg is too short.
        let short = [0, 1].map(|i| legs[i].short_by(tree, links, &self.feet[i].pose));
        let wanted = short[0].max(short[1]).min(DEEPEST);
        self.down.follow(wanted, SINKS_S, f32::INFINITY, step.dt);
        let down = self.down.at;
        pose.root.translation.vector.z -= down;
        for link in links.iter_mut() {
            link.translation.vector.z -= down;
        }
        for (leg, foot) in legs.iter().zip(&self.feet) {
            leg.reach(tree, pose, links, &foot.pose);
        }
        let first = legs[0].first().min(legs[1].first());
        tree.place(pose, links, first);
        for (leg, foot) in legs.iter().zip(&mut self.feet) {
            foot.pose = links[leg.foot];
        }
    }
}

impl Foot {
    /// Moves the foot on; `own` is where its gait has it.
    fn go_on(&mut self, side: usize, step: &Step, leg: &Leg, own: &Isometry3<f32>) {
        // The right foot comes down half a cycle after the left one.
        let phase = (step.phase - 0.5 * side as f32).rem_euclid(1.0);
        let stance = step.stance[side].clamp(0.1, 0.9);
        match !step.steps || phase < stance {
            true => self.stand(leg, own),
            false => self.swing((phase - stance) / (1.0 - stance), step, leg, own),
        }
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.offset.turn);
        let at = own.translation.vector + self.offset.shift.push(self.offset.lift);
        self.pose = Isometry3::from_parts(Translation3::from(at), turn * own.rotation);
    }

    /// Stands: it points where it pointed, and its lowest point stays where it was.
    fn stand(&mut self, leg: &Leg, own: &Isometry3<f32>) {
        if !self.stands {
            self.stands = true;
            self.heading = leg.heading(&self.pose.rotation);
        }
        let turn = apart(leg.heading(&own.rotation), self.heading);
        let about = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn);
        let turned = Isometry3::from_parts(own.translation, about * own.rotation);
        let (point, height) = leg.lowest(&turned);
        let shift = (self.pose * point - turned * point).xy();
        self.offset = Offset {
            shift,
            turn,
            lift: -height,
        };
    }

    /// Swings: what was off when it left fades, and it comes down where its gait has it then, turned ahead.
    fn swing(&mut self, done: f32, step: &Step, leg: &Leg, own: &Isometry3<f32>) {
        if self.stands {
            self.stands = false;
            self.left_with = self.offset;
        }
        let come = smooth(done);
        let lead = step.lead.clamp(-FARTHEST_LEAD, FARTHEST_LEAD);
        let about = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), lead);
        let arm = own.translation.vector - step.root.translation.vector;
        let ahead = (about * arm - arm).xy();
        let turn = self.left_with.turn * (1.0 - come) + lead * come;
        let shift = self.left_with.shift * (1.0 - come) + ahead * come;
        let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn) * own.rotation;
        let (_, height) = leg.lowest(&Isometry3::from_parts(own.translation, turned));
        let lands = smooth((done - LANDS) / (1.0 - LANDS));
        let bump = (std::f32::consts::PI * done).sin().powi(2) * CLEARANCE * (1.0 - step.size);
        let lift = self.left_with.lift * (1.0 - come) * (1.0 - lands) - height * lands + bump;
        self.offset = Offset {
            shift,
            turn,
            // Never into the ground.
            lift: lift.max(-height),
        };
    }
}

/// From 0 at 0 to 1 at 1, level at both ends.
fn smooth(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}
