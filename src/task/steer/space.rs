//! All gaits of a character, by direction and speed: what a wished velocity is made of.

use super::gait::Gait;
use super::mirror::Mirror;
use super::pose::Mix;
use nalgebra::Vector2;
use std::f32::consts::{PI, TAU};

/// Gaits whose directions are at most this far apart go the same way, radians. Chosen.
const SAME_WAY: f32 = 0.6;
/// Gaits whose speeds differ by at most this share are equally fast. Chosen.
const SAME_SPEED: f32 = 0.25;
/// Longest cycle of slow steps, s. Chosen: someone who strolls takes 1.5 steps a second.
const LONGEST: f32 = 1.3;
/// Slowest that steps are lengthened and shortened with, as a share of the slowest gait's speed: below, steps come as often as
/// here and are only shorter.
const EPSILON: f32 = 1e-3;

/// Gaits that go one way, the slowest first.
#[derive(Clone, Debug)]
struct Way {
    /// Direction in the frame that faces along X, radians.
    angle: f32,
    gaits: Vec<Gait>,
}

/// What a velocity is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stride {
    /// Seconds of a cycle.
    pub period: f32,
    /// How much of a gait it is, 0 to 1; the rest stands.
    pub size: f32,
    /// Share of the cycle in which each foot stands; left, right.
    pub stance: [f32; 2],
}

/// Gaits in all directions.
#[derive(Clone, Debug)]
pub(super) struct GaitSpace {
    /// Sorted by angle.
    ways: Vec<Way>,
}

impl GaitSpace {
    /// A space of these gaits. Missing sides are mirrored, and who can't walk backward walks forward in reverse.
    pub fn new(gaits: Vec<Gait>, mirror: &Mirror) -> GaitSpace {
        let mut all = gaits.clone();
        for gait in &gaits {
            let mirrored = gait.mirrored(mirror);
            if !all.iter().any(|other| is_alike(other, &mirrored)) {
                all.push(mirrored);
            }
        }
        let backward = |gait: &Gait| angle(&gait.velocity).abs() > PI - SAME_WAY;
        let forward = |gait: &&Gait| angle(&gait.velocity).abs() < SAME_WAY;
        if !all.iter().any(backward)
            && let Some(slowest) = all.iter().filter(forward).min_by(by_speed)
        {
            all.push(slowest.reversed());
        }
        let mut ways: Vec<Way> = Vec::new();
        for gait in all {
            let own = angle(&gait.velocity);
            match ways
                .iter_mut()
                .find(|w| apart(w.angle, own).abs() < SAME_WAY)
            {
                Some(way) => way.gaits.push(gait),
                None => ways.push(Way {
                    angle: own,
                    gaits: vec![gait],
                }),
            }
        }
        for way in &mut ways {
            way.gaits.sort_by(|a, b| a.speed().total_cmp(&b.speed()));
        }
        ways.sort_by(|a, b| a.angle.total_cmp(&b.angle));
        GaitSpace { ways }
    }

    /// Whether there is a gait to the side.
    pub fn strafes(&self) -> bool {
        let gaits = self.ways.iter().flat_map(|way| &way.gaits);
        let mut angles = gaits.map(|gait| angle(&gait.velocity).abs());
        angles.any(|a| (SAME_WAY..PI - SAME_WAY).contains(&a))
    }

    /// Fastest speed in the direction of `velocity`, in the frame that faces along X, m/s.
    pub fn fastest(&self, velocity: &Vector2<f32>) -> f32 {
        let fastest = |way: &Way| way.gaits.last().map_or(0.0, Gait::speed);
        let [(a, near), (b, far)] = self.ways_of(velocity);
        near * fastest(&self.ways[a]) + far * fastest(&self.ways[b])
    }

    /// What this velocity, m/s in the frame that faces along X, is made of; the poses at `phase` are added to `mix` with weights
    /// that sum up to the stride's size.
    pub fn stride(&self, velocity: &Vector2<f32>, phase: f32, mix: &mut Mix) -> Stride {
        let speed = velocity.norm();
        let mut sum = Stride {
            period: 0.0,
            size: 0.0,
            stance: [0.0; 2],
        };
        for (way, share) in self.ways_of(velocity) {
            if share <= 0.0 {
                continue;
            }
            let part = self.ways[way].stride(speed, share, phase, mix);
            sum.period += share * part.period;
            sum.size += share * part.size;
            for (total, stance) in sum.stance.iter_mut().zip(part.stance) {
                *total += share * stance;
            }
        }
        sum
    }

    /// The two ways between which a velocity goes, with their shares.
    fn ways_of(&self, velocity: &Vector2<f32>) -> [(usize, f32); 2] {
        let wanted = angle(velocity);
        let count = self.ways.len();
        // The way before it, turning left, and the one after.
        let after = self.ways.iter().position(|way| way.angle > wanted);
        let after = after.unwrap_or(0);
        let before = (after + count - 1) % count;
        let whole = ahead(self.ways[before].angle, self.ways[after].angle);
        let part = (wanted - self.ways[before].angle).rem_euclid(TAU);
        match count {
            1 => [(before, 1.0), (before, 0.0)],
            _ => [(before, 1.0 - part / whole), (after, part / whole)],
        }
    }
}

impl Way {
    /// As [`GaitSpace::stride`]; weights are multiplied by `share`.
    fn stride(&self, speed: f32, share: f32, phase: f32, mix: &mut Mix) -> Stride {
        let faster = self.gaits.iter().position(|gait| gait.speed() >= speed);
        match faster {
            Some(0) => slow(&self.gaits[0], speed, share, phase, mix),
            Some(i) => between(&self.gaits[i - 1..=i], speed, share, phase, mix),
            None => fast(&self.gaits[self.gaits.len() - 1], speed, share, phase, mix),
        }
    }
}

/// Slower than the slowest gait: its steps are shorter and come less often, both by the square root of the speed. The rest of
/// the weight is for standing.
fn slow(gait: &Gait, speed: f32, share: f32, phase: f32, mix: &mut Mix) -> Stride {
    let part = (speed / gait.speed()).max(EPSILON);
    let period = (gait.period / part.sqrt()).min(LONGEST.max(gait.period));
    let size = part * period / gait.period;
    gait.add(phase, share * size, mix);
    Stride {
        period,
        size,
        stance: gait.stance,
    }
}

/// Between two gaits: the length of a cycle's way is between theirs, and its time what the speed then takes.
fn between(gaits: &[Gait], speed: f32, share: f32, phase: f32, mix: &mut Mix) -> Stride {
    let (a, b) = (&gaits[0], &gaits[1]);
    let blend = (speed - a.speed()) / (b.speed() - a.speed()).max(f32::MIN_POSITIVE);
    a.add(phase, share * (1.0 - blend), mix);
    b.add(phase, share * blend, mix);
    let way = |gait: &Gait| gait.speed() * gait.period;
    Stride {
        period: ((1.0 - blend) * way(a) + blend * way(b)) / speed,
        size: 1.0,
        stance: std::array::from_fn(|i| (1.0 - blend) * a.stance[i] + blend * b.stance[i]),
    }
}

/// Faster than the fastest gait: the same steps, more often.
fn fast(gait: &Gait, speed: f32, share: f32, phase: f32, mix: &mut Mix) -> Stride {
    gait.add(phase, share, mix);
    Stride {
        period: gait.period * gait.speed() / speed,
        size: 1.0,
        stance: gait.stance,
    }
}

/// Whether two gaits go the same way about as fast.
fn is_alike(a: &Gait, b: &Gait) -> bool {
    let same_way = apart(angle(&a.velocity), angle(&b.velocity)).abs() < SAME_WAY;
    same_way && (a.speed() - b.speed()).abs() < SAME_SPEED * a.speed().max(b.speed())
}

fn by_speed(a: &&Gait, b: &&Gait) -> std::cmp::Ordering {
    a.speed().total_cmp(&b.speed())
}

/// Direction of a velocity, radians.
fn angle(velocity: &Vector2<f32>) -> f32 {
    velocity.y.atan2(velocity.x)
}

/// The turn from one angle to another, the short way round, radians.
pub(super) fn apart(from: f32, to: f32) -> f32 {
    (to - from + PI).rem_euclid(TAU) - PI
}

/// The turn from one angle to another, to the left, radians.
fn ahead(from: f32, to: f32) -> f32 {
    let turn = (to - from).rem_euclid(TAU);
    if turn > 0.0 { turn } else { TAU }
}
