//! Mass, centre of mass, zero-moment point and support polygon of a posed rig.

use crate::rig::{
    ANKLE_HEIGHT, BALL_HEIGHT, CHEST, HAND, HEAD, HEAD_TOP, HEEL_BEHIND, HIPS, JOINTS, NECK, Pose,
    Rig, SHOULDER, SPINE, TOES, UP_LEG, V3, side_sign,
};
use nalgebra::Vector2;

/// Ground coordinates: x to the left, z forward, m.
pub type Ground = Vector2<f64>;

/// m/s².
pub const GRAVITY: f64 = 9.81;
/// A sole point lower than this stands on the ground, m.
pub const TOUCH: f64 = 0.001;
const HALF_WIDTH_HEEL: f64 = 0.032;
const HALF_WIDTH_BALL: f64 = 0.045;

/// A mass point fixed to a joint's frame.
struct Point {
    joint: usize,
    /// From the joint, world axes at rest, m.
    at: V3,
    /// Fraction of body mass.
    mass: f64,
}

/// The body as mass points: every segment is two halves of its mass, one radius of gyration to either side of its
/// centre of mass, so that mass, centre and transverse inertia are right.
///
/// Mass fractions, centres of mass and radii of gyration: Dempster's, in Winter (2009), table 4.1.
pub struct Body(Vec<Point>);

impl Body {
    pub fn new(rig: &Rig) -> Self {
        let mut body = Self(Vec::new());
        let mut add = |joint: usize, end: V3, mass: f64, centre: f64, gyration: f64| {
            for sign in [-1.0, 1.0] {
                let at = end * (centre + sign * gyration);
                body.0.push(Point {
                    joint,
                    at,
                    mass: mass / 2.0,
                });
            }
        };
        // The trunk's parts have no radii of gyration in the table; 0.29 is that of an even rod.
        add(HIPS, rig.offset(HIPS, SPINE) * 2.0, 0.142, 0.0, 0.29);
        add(SPINE, rig.offset(SPINE, CHEST), 0.139, 0.44, 0.29);
        add(CHEST, rig.offset(CHEST, NECK), 0.216, 0.5, 0.29);
        let head = V3::new(0.0, rig.rest[HEAD_TOP].y - rig.rest[NECK].y, 0.0);
        let to_head = rig.offset(NECK, HEAD);
        add(HEAD, head, 0.081, 0.55 - to_head.y / head.y, 0.25);
        for side in 0..2 {
            let (arm, leg) = (SHOULDER[side] + 1, UP_LEG[side]);
            add(arm, rig.offset(arm, arm + 1), 0.028, 0.436, 0.322);
            add(arm + 1, rig.offset(arm + 1, arm + 2), 0.016, 0.430, 0.303);
            add(
                arm + 2,
                V3::x() * side_sign(side) * HAND,
                0.006,
                0.506,
                0.297,
            );
            add(leg, rig.offset(leg, leg + 1), 0.100, 0.433, 0.323);
            add(leg + 1, rig.offset(leg + 1, leg + 2), 0.0465, 0.433, 0.302);
            add(leg + 2, rig.offset(leg + 2, leg + 3), 0.0145, 0.50, 0.475);
        }
        body
    }

    fn points(&self, rig: &Rig, pose: &Pose) -> Vec<V3> {
        let at = pose.positions(rig);
        let place = |p: &Point| at[p.joint] + pose.turn[p.joint] * p.at;
        self.0.iter().map(place).collect()
    }

    fn total(&self) -> f64 {
        self.0.iter().map(|p| p.mass).sum()
    }

    /// Whole-body centre of mass, m.
    pub fn com(&self, rig: &Rig, pose: &Pose) -> V3 {
        let points = self.points(rig, pose);
        let weighted = self.0.iter().zip(points).map(|(p, at)| at * p.mass);
        weighted.sum::<V3>() / self.total()
    }

    /// Zero-moment point of every pose, `dt` seconds apart (Vukobratović and Borovac, Int. J. Humanoid Robotics 1,
    /// 2004), accelerations by central differences. `before` and `after` are the poses beyond the ends.
    pub fn zmp(
        &self,
        rig: &Rig,
        poses: &[Pose],
        before: &Pose,
        after: &Pose,
        dt: f64,
    ) -> Vec<Ground> {
        let mut points = vec![self.points(rig, before)];
        points.extend(poses.iter().map(|pose| self.points(rig, pose)));
        points.push(self.points(rig, after));
        points.windows(3).map(|w| self.zmp_of(w, dt)).collect()
    }

    fn zmp_of(&self, window: &[Vec<V3>], dt: f64) -> Ground {
        let (mut moment, mut force) = (Ground::zeros(), 0.0);
        for (i, p) in self.0.iter().enumerate() {
            let at = window[1][i];
            let acceleration = (window[0][i] - at * 2.0 + window[2][i]) / (dt * dt);
            let lift = p.mass * (acceleration.y + GRAVITY);
            moment += ground(at) * lift - ground(acceleration) * (p.mass * at.y);
            force += lift;
        }
        moment / force
    }
}

pub fn ground(at: V3) -> Ground {
    Ground::new(at.x, at.z)
}

/// The sole's corners in the world: heel (on the foot), ball and tip (on the toes), right then left of each.
pub fn sole(rig: &Rig, pose: &Pose, side: usize) -> [V3; 6] {
    let at: [V3; JOINTS] = pose.positions(rig);
    let (ankle, ball) = (UP_LEG[side] + 2, UP_LEG[side] + 3);
    let on_foot = |x: f64, z: f64| at[ankle] + pose.turn[ankle] * V3::new(x, -ANKLE_HEIGHT, z);
    let on_toes = |x: f64, z: f64| at[ball] + pose.turn[ball] * V3::new(x, -BALL_HEIGHT, z);
    let (heel, wide) = (HALF_WIDTH_HEEL, HALF_WIDTH_BALL);
    [
        on_foot(-heel, -HEEL_BEHIND),
        on_foot(heel, -HEEL_BEHIND),
        on_toes(-wide, 0.0),
        on_toes(wide, 0.0),
        on_toes(-wide, TOES),
        on_toes(wide, TOES),
    ]
}

/// How far `point` lies inside the convex hull of the sole corners that touch the ground, m; negative outside,
/// infinitely so without contact.
pub fn margin(rig: &Rig, pose: &Pose, point: Ground) -> f64 {
    let soles = (0..2).flat_map(|side| sole(rig, pose, side));
    let touching: Vec<Ground> = soles.filter(|p| p.y < TOUCH).map(ground).collect();
    let hull = hull(touching);
    let edges = (0..hull.len()).map(|i| (hull[i], hull[(i + 1) % hull.len()]));
    let inside = edges.map(|(a, b)| (b - a).normalize().perp(&(point - a)));
    if hull.len() < 3 {
        return f64::NEG_INFINITY;
    }
    inside.fold(f64::INFINITY, f64::min)
}

/// Convex hull, counter-clockwise (Andrew's monotone chain).
fn hull(mut points: Vec<Ground>) -> Vec<Ground> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let chain = |points: &mut dyn Iterator<Item = Ground>| {
        let mut out: Vec<Ground> = Vec::new();
        for p in points {
            while let [.., a, b] = out[..] {
                if (b - a).perp(&(p - b)) > 1e-12 {
                    break;
                }
                out.pop();
            }
            out.push(p);
        }
        out.pop();
        out
    };
    let mut lower = chain(&mut points.iter().copied());
    lower.extend(chain(&mut points.iter().rev().copied()));
    lower
}
