//! Self-collision: limbs that would pass through each other or the trunk.
//!
//! Every shape is taken for a capsule: the distance of two of them is that of two segments, which is cheap and smooth nearly
//! everywhere.

use crate::skeleton::{Shape, Skeleton};
use nalgebra::{Isometry3, Point3, Vector3};

/// A shape as a capsule: a segment with a radius, in its body's frame, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Capsule {
    body: usize,
    ends: [Vector3<f64>; 2],
    radius: f64,
}

/// Two capsules that should stay apart: they are apart in the rest pose, and their bodies are neither joined nor hang on the
/// same one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair([Capsule; 2]);

/// Where two capsules are in each other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Overlap {
    /// Indices of their bodies.
    pub bodies: [usize; 2],
    /// The nearest points on the axes of both, world, metres.
    pub points: [Vector3<f64>; 2],
    /// Unit vector from the second to the first, world.
    pub normal: Vector3<f64>,
    /// How far they are in each other, metres.
    pub depth: f64,
}

/// All pairs of a skeleton that should stay apart.
pub(super) fn pairs(skeleton: &Skeleton) -> Vec<Pair> {
    let rest = skeleton.forward(&skeleton.rest_qpos());
    let bodies = skeleton.bodies.iter().enumerate();
    let capsules: Vec<Capsule> = bodies
        .flat_map(|(b, body)| body.shapes.iter().map(move |shape| capsule(b, shape)))
        .collect();
    let joined = |a: usize, b: usize| {
        let parent = |body: usize| skeleton.bodies[body].parent;
        a == b || parent(a) == Some(b) || parent(b) == Some(a) || parent(a) == parent(b)
    };
    let mut found = Vec::new();
    for (i, a) in capsules.iter().enumerate() {
        for b in capsules[i + 1..].iter().filter(|b| !joined(a.body, b.body)) {
            let pair = Pair([*a, *b]);
            // Shapes of neighbours overlap by design, as those of hand and forearm do.
            if pair.overlap(&rest).is_none() {
                found.push(pair);
            }
        }
    }
    found
}

/// The capsule of a shape. That of a box lies along its longest side and is as thick as the mean of the others.
fn capsule(body: usize, shape: &Shape) -> Capsule {
    let (ends, radius) = match shape {
        Shape::Sphere { center, radius } => ([*center; 2], *radius),
        Shape::Capsule { a, b, radius } => ([*a, *b], *radius),
        Shape::Box { pose, half } => {
            let long = half.imax();
            let radius = (half.sum() - half[long]) / 2.0;
            let along = Vector3::ith(long, (half[long] - radius).max(0.0));
            let end = |v: Vector3<f64>| (pose * Point3::from(v)).coords;
            ([end(along), end(-along)], radius)
        }
    };
    Capsule { body, ends, radius }
}

impl Capsule {
    /// A ball around the capsule: its centre, world, and its radius, metres.
    fn middle_and_reach(&self, pose: &Isometry3<f64>) -> (Point3<f64>, f64) {
        let [a, b] = self.ends;
        let reach = (a - b).norm() / 2.0 + self.radius;
        (pose * Point3::from((a + b) / 2.0), reach)
    }
}

impl Pair {
    /// Where the two are in each other, with all bodies at these places.
    pub fn overlap(&self, bodies: &[Isometry3<f64>]) -> Option<Overlap> {
        let [one, other] = &self.0;
        let (first, second) = (&bodies[one.body], &bodies[other.body]);
        // Most pairs are far apart, which their balls tell quickly.
        let (a, reach) = one.middle_and_reach(first);
        let (b, other_reach) = other.middle_and_reach(second);
        if (a - b).norm_squared() > (reach + other_reach).powi(2) {
            return None;
        }
        let place = |pose: &Isometry3<f64>, v: &Vector3<f64>| (pose * Point3::from(*v)).coords;
        let points = nearest(
            one.ends.map(|end| place(first, &end)),
            other.ends.map(|end| place(second, &end)),
        );
        let apart = points[0] - points[1];
        let distance = apart.norm();
        let depth = one.radius + other.radius - distance;
        // Axes that cross have no side to go apart to.
        (depth > 0.0 && distance > 1e-6).then(|| Overlap {
            bodies: [one.body, other.body],
            points,
            normal: apart / distance,
            depth,
        })
    }
}

/// The points of two segments that are nearest to each other (Ericson, Real-Time Collision Detection, 2005, section 5.1.9).
fn nearest([p, p_end]: [Vector3<f64>; 2], [q, q_end]: [Vector3<f64>; 2]) -> [Vector3<f64>; 2] {
    let (along_p, along_q, between) = (p_end - p, q_end - q, p - q);
    let (pp, qq) = (along_p.norm_squared(), along_q.norm_squared());
    let (pq, p_between, q_between) = (
        along_p.dot(&along_q),
        along_p.dot(&between),
        along_q.dot(&between),
    );
    // A segment without a length is a point.
    let share = |value: f64, of: f64| {
        if of > 1e-12 {
            (value / of).clamp(0.0, 1.0)
        } else {
            0.0
        }
    };
    // The nearest point of the first line, clamped to the segment; that of the second for it; and the first again, for the
    // clamped one.
    let mut s = share(pq * q_between - p_between * qq, pp * qq - pq * pq);
    let t = share(pq * s + q_between, qq);
    s = share(pq * t - p_between, pp);
    [p + along_p * s, q + along_q * t]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: [Vector3<f64>; 2], b: [Vector3<f64>; 2], distance: f64) {
        let [p, q] = nearest(a, b);
        assert!(
            ((p - q).norm() - distance).abs() < 1e-9,
            "{a:?}, {b:?}: {p}, {q}"
        );
    }

    #[test]
    fn the_nearest_points_of_segments_are_found() {
        let v = Vector3::new;
        let along = [v(-1.0, 0.0, 0.0), v(1.0, 0.0, 0.0)];
        close(along, [v(0.0, -1.0, 0.5), v(0.0, 1.0, 0.5)], 0.5);
        close(along, [v(2.0, -1.0, 0.0), v(2.0, 1.0, 0.0)], 1.0);
        close(along, [v(-3.0, 0.3, 0.0), v(3.0, 0.3, 0.0)], 0.3);
        close(along, [v(4.0, 4.0, 0.0); 2], 5.0);
        close([v(0.0, 0.0, 3.0); 2], [v(0.0, 4.0, 0.0); 2], 5.0);
        close(along, [v(3.0, 1.0, 0.0), v(2.0, 0.0, 0.0)], 1.0);
    }

    #[test]
    fn a_hand_in_the_thigh_is_seen_and_the_rest_pose_has_none() {
        let skeleton = Skeleton::load("humanoid").expect("the built-in humanoid loads");
        let pairs = pairs(&skeleton);
        let mut bodies = skeleton.forward(&skeleton.rest_qpos());
        assert!(pairs.iter().all(|pair| pair.overlap(&bodies).is_none()));
        let number = |name: &str| skeleton.bodies.iter().position(|b| b.name == name);
        let (hand, thigh) = (number("left_hand"), number("right_thigh"));
        let (hand, thigh) = (hand.expect("a hand"), thigh.expect("a thigh"));
        let middle = Point3::new(0.03, 0.0, -0.2);
        bodies[hand].translation = (bodies[thigh] * middle).coords.into();
        let found = pairs.iter().filter_map(|pair| pair.overlap(&bodies));
        let found: Vec<Overlap> = found.collect();
        let is_theirs = |o: &&Overlap| o.bodies.contains(&hand) && o.bodies.contains(&thigh);
        let overlap = found.iter().find(is_theirs).expect("they overlap");
        // humanoid.xml: a hand of 4 cm about its origin, a thigh of 5.5 cm about its axis.
        assert!(
            (overlap.depth - (0.04 + 0.055 - 0.03)).abs() < 1e-6,
            "{}",
            overlap.depth
        );
    }
}
