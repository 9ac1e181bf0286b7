//! A kinematic character that goes where it is asked to: its root follows springs, its pose is made of gaits, and its feet stay
//! where they stand.

use super::feet::{Feet, Step};
use super::gaits::Gaits;
use super::pose::{Mix, Pose};
use super::space::{Stride, apart};
use super::spring::Spring;
use crate::task::step::Wish;
use nalgebra::{Isometry3, Point3, Rotation2, Translation3, UnitQuaternion, Vector2, Vector3};
use std::f32::consts::{FRAC_PI_2, TAU};

// All chosen.

/// Time constants of the springs, s: 63 % of a change of velocity is there after 2.1 of them.
const VELOCITY_S: f32 = 0.2;
const HEADING_S: f32 = 0.2;
/// Hardest acceleration, m/s²: a third of what friction permits. A person who walks and is asked to stop takes a step for it.
const HARDEST: f32 = 3.0;
/// Fastest turn on the spot, rad/s: half a turn in 0.9 s. At the speed beside it, m/s, it is half of that: who runs turns slowly.
const FASTEST_TURN: f32 = 3.5;
const TURNS_HALF: f32 = 2.5;
/// Who is to face where it goes faces where it will go after this time, s.
const LOOKS_AHEAD: f32 = 0.3;
/// Slowest wish that is one, m/s, and speed below which who is to go somewhere doesn't go anywhere yet.
const WISHES: f32 = 0.05;
const SLOW: f32 = 0.3;
/// Speed below which a character that is to stand does, m/s, and rate of turning, rad/s.
const STANDS: [f32; 2] = [0.04, 0.15];
/// Turn of the trunk over standing feet from which on they step, radians.
const TWIST: f32 = 0.25;
/// Share of the cycle in which a foot stands in the shortest steps: somewhat longer than it swings.
const SHORT_STANCE: f32 = 0.6;
/// Turn of the root from one step to the next, at most, radians.
const TURN_A_STEP: f32 = 1.0;
/// Shortest cycle, s: no foot swings in less than a fifth of a second.
const SHORTEST: f32 = 0.55;
/// Longest cycle of steps that close a walk or turn on the spot, s.
const CLOSING: f32 = 0.9;
/// Part of an acceleration that the trunk leans into, as a share of a = g tan(lean) …
const LEANS: f32 = 0.4;
/// … and gravity, m/s².
const GRAVITY: f32 = 9.81;

/// Where a walker is and how it goes on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Walker {
    /// The point on the ground that it travels with, metres.
    pub place: Vector2<f32>,
    /// Velocity over the ground, m/s.
    pub velocity: Spring<Vector2<f32>>,
    /// The direction it faces, radians; it isn't wrapped.
    pub heading: Spring<f32>,
    /// Phase of its gait.
    pub phase: f32,
    /// Seconds that it has been.
    pub time: f32,
    /// Whether it takes steps.
    pub steps: bool,
    /// Its feet.
    pub feet: Feet,
}

/// Buffers that a step of any walker writes into.
pub(super) struct Scratch {
    mix: Mix,
    pose: Pose,
    /// Where the links are after the step.
    pub links: Vec<Isometry3<f32>>,
}

impl Scratch {
    /// Buffers for characters of these gaits.
    pub fn new(gaits: &Gaits) -> Scratch {
        let links = gaits.links();
        Scratch {
            mix: Mix::new(links),
            pose: gaits.rest.clone(),
            links: vec![Isometry3::identity(); links],
        }
    }
}

impl Walker {
    /// A walker that stands at the origin and faces along X.
    pub fn new(gaits: &Gaits, scratch: &mut Scratch) -> Walker {
        let mut walker = Walker {
            place: Vector2::zeros(),
            velocity: Spring {
                at: Vector2::zeros(),
                rate: Vector2::zeros(),
            },
            heading: Spring { at: 0.0, rate: 0.0 },
            phase: 0.0,
            time: 0.0,
            steps: false,
            feet: Feet::default(),
        };
        walker.pose(gaits, scratch);
        walker.feet = Feet::standing(&gaits.legs, &scratch.links);
        walker.advance(&Wish::default(), 0.0, gaits, scratch);
        walker
    }

    /// Moves it along the ground, metres.
    pub fn shift(&mut self, by: &Vector2<f32>) {
        self.place += by;
        self.feet.shift(by);
    }

    /// Goes on for `dt` seconds, and writes where the links are then.
    pub fn advance(&mut self, wish: &Wish, dt: f32, gaits: &Gaits, scratch: &mut Scratch) {
        let goal = self.lead(wish, dt, gaits);
        let stride = self.pose(gaits, scratch);
        self.begin_or_end_steps(&goal, &stride, gaits, scratch);
        let period = self.period(&goal, &stride);
        if self.steps {
            self.phase = (self.phase + dt / period).rem_euclid(1.0);
        }
        let step = Step {
            phase: self.phase,
            steps: self.steps,
            stance: stance(&stride),
            size: stride.size,
            root: self.frame(),
            dt,
            // A foot comes down turned to where the trunk will be in the middle of its stance.
            lead: self.heading.rate * period * SHORT_STANCE / 2.0,
        };
        let (pose, links) = (&mut scratch.pose, &mut scratch.links);
        self.feet
            .place(&step, &gaits.legs, &gaits.tree, pose, links);
    }

    /// Writes about where the links will be in `dt` seconds, if the wish stays, and returns which feet will stand: as the gaits have
    /// it, wherever the feet stand now.
    pub fn preview(&self, wish: &Wish, dt: f32, gaits: &Gaits, scratch: &mut Scratch) -> [bool; 2] {
        let mut later = *self;
        let before = later.pose(gaits, scratch);
        let goal = later.lead(wish, dt, gaits);
        let goes = self.steps || goal.norm() > 0.0;
        if goes {
            later.phase += dt / later.period(&goal, &before);
        }
        let stance = stance(&later.pose(gaits, scratch));
        let stands =
            |foot: usize| !goes || (later.phase - 0.5 * foot as f32).rem_euclid(1.0) < stance[foot];
        [stands(0), stands(1)]
    }

    /// Leads the root on for `dt` seconds; returns the velocity that it comes to.
    fn lead(&mut self, wish: &Wish, dt: f32, gaits: &Gaits) -> Vector2<f32> {
        let goal = self.goal(wish, gaits);
        self.velocity.follow(&goal, VELOCITY_S, HARDEST, dt);
        self.turn(wish, &goal, dt);
        self.place += self.velocity.at * dt;
        self.time += dt;
        goal
    }

    /// The velocity that the wish comes to: no faster than the gaits go.
    fn goal(&self, wish: &Wish, gaits: &Gaits) -> Vector2<f32> {
        let speed = wish.velocity.norm();
        if speed < WISHES {
            return Vector2::zeros();
        }
        // Once it faces as it is asked to.
        let facing = wish
            .facing
            .unwrap_or_else(|| wish.velocity.y.atan2(wish.velocity.x));
        let own = Rotation2::new(-facing) * wish.velocity;
        wish.velocity * (gaits.space.fastest(&own) / speed).min(1.0)
    }

    /// Turns to where it is to face: as asked, or where it will go.
    fn turn(&mut self, wish: &Wish, goal: &Vector2<f32>, dt: f32) {
        let wanted = wish.facing.or_else(|| self.way(goal));
        let turn = apart(self.heading.at, wanted.unwrap_or(self.heading.at));
        // Halfway round, it goes on in the direction in which it already turns.
        let turn = match turn.abs() > FRAC_PI_2 && turn * self.heading.rate < -0.1 {
            true => turn + TAU * self.heading.rate.signum(),
            false => turn,
        };
        let speed = self.velocity.at.norm() / TURNS_HALF;
        let fastest = FASTEST_TURN / (1.0 + speed * speed);
        let wanted = self.heading.at + turn;
        self.heading.follow(wanted, HEADING_S, fastest, dt);
    }

    /// The direction in which it will go, radians; `None` for who is to stand.
    fn way(&self, goal: &Vector2<f32>) -> Option<f32> {
        if goal.norm() < WISHES {
            return None;
        }
        let mut soon = self.velocity;
        soon.follow(goal, VELOCITY_S, HARDEST, LOOKS_AHEAD);
        // Who hardly goes any more looks where it is to go.
        let way = match soon.at.norm() > SLOW {
            true => soon.at,
            false => *goal,
        };
        Some(way.y.atan2(way.x))
    }

    /// The frame on the ground that it travels with.
    pub fn frame(&self) -> Isometry3<f32> {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.heading.at);
        Isometry3::from_parts(Translation3::new(self.place.x, self.place.y, 0.0), turn)
    }

    /// Writes the links of its pose, before feet are where they stand.
    fn pose(&self, gaits: &Gaits, scratch: &mut Scratch) -> Stride {
        let own = Rotation2::new(-self.heading.at) * self.velocity.at;
        scratch.mix.clear();
        let stride = gaits.space.stride(&own, self.phase, &mut scratch.mix);
        gaits
            .idle
            .add(self.time, 1.0 - stride.size, &mut scratch.mix);
        scratch.mix.mean(&mut scratch.pose);
        // It leans into an acceleration, about its hips: its centre of mass goes the way of the spring.
        let push = Rotation2::new(-self.heading.at) * self.velocity.rate;
        let lean = Vector3::new(-push.y, push.x, 0.0) * (LEANS / GRAVITY);
        let about = Point3::new(0.0, 0.0, scratch.pose.root.translation.z);
        let lean = UnitQuaternion::from_scaled_axis(lean);
        scratch.pose.root =
            self.frame() * Isometry3::rotation_wrt_point(lean, about) * scratch.pose.root;
        gaits.tree.place(&scratch.pose, &mut scratch.links, 0);
        stride
    }

    /// Begins to step when it is to go or turn, and ends once it stands with both feet where they belong.
    fn begin_or_end_steps(
        &mut self,
        goal: &Vector2<f32>,
        stride: &Stride,
        gaits: &Gaits,
        scratch: &Scratch,
    ) {
        let [slow, still] = STANDS;
        let is_to_go = goal.norm() > 0.0 || self.velocity.at.norm() > slow;
        let turns = self.heading.rate.abs() > still;
        let off = self.feet.off(&gaits.legs, &scratch.links);
        if !self.steps && (is_to_go || off.turn.abs() > TWIST || off.far) {
            self.steps = true;
            self.phase = self.first_step(goal, stride);
        } else if self.steps && !is_to_go && !turns && self.feet.both_stand() && off.near {
            self.steps = false;
        }
    }

    /// The phase at which the first foot leaves: the one on the side to which it goes or turns.
    fn first_step(&self, goal: &Vector2<f32>, stride: &Stride) -> f32 {
        let own = Rotation2::new(-self.heading.at) * goal;
        let side = own.y + 0.5 * self.heading.rate;
        let [left, right] = stance(stride);
        match side >= 0.0 {
            true => left,
            false => (right + 0.5).rem_euclid(1.0),
        }
    }

    /// Seconds of a cycle: shorter where the trunk turns so fast that feet couldn't follow, or where steps only close a walk.
    fn period(&self, goal: &Vector2<f32>, stride: &Stride) -> f32 {
        let turning = 2.0 * TURN_A_STEP / self.heading.rate.abs().max(f32::MIN_POSITIVE);
        let closing = match goal.norm() > 0.0 {
            true => f32::INFINITY,
            false => CLOSING,
        };
        stride.period.min(turning).min(closing).max(SHORTEST)
    }
}

/// Share of the cycle in which each foot stands: the shorter the steps, the nearer to that of short steps.
fn stance(stride: &Stride) -> [f32; 2] {
    let short = SHORT_STANCE * (1.0 - stride.size);
    stride.stance.map(|share| share * stride.size + short)
}
