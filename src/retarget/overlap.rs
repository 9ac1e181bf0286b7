//! Self-collision: limbs that would pass through each other or the trunk.

use crate::skeleton::{Shape, Skeleton};
use nalgebra::{Isometry3, Point3, Vector3};

/// A shape as a segment with a radius, in its body's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Piece {
    body: usize,
    ends: [Vector3<f64>; 2],
    radius: f64,
}

/// Two pieces that are apart in the rest pose, of bodies that are neither joined nor hang on the same one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair([Piece; 2]);

/// Where two pieces are in each other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Overlap {
    pub bodies: [usize; 2],
    /// On the axes of both, world.
    pub points: [Vector3<f64>; 2],
    /// From the second to the first, of length one.
    pub normal: Vector3<f64>,
    /// Metres.
    pub depth: f64,
}

/// All pairs of a skeleton that should stay apart.
pub(super) fn pairs(skeleton: &Skeleton) -> Vec<Pair> {
    let rest = skeleton.forward(&skeleton.rest_qpos());
    let bodies = skeleton.bodies.iter().enumerate();
    let pieces: Vec<Piece> = bodies
        .flat_map(|(b, body)| body.shapes.iter().map(move |shape| piece(b, shape)))
        .collect();
    let joined = |a: usize, b: usize| {
        let parent = |body: usize| skeleton.bodies[body].parent;
        a == b || parent(a) == Some(b) || parent(b) == Some(a) || parent(a) == parent(b)
    };
    let mut found = Vec::new();
    for (i, a) in pieces.iter().enumerate() {
        for b in pieces[i + 1..].iter().filter(|b| !joined(a.body, b.body)) {
            let pair = Pair([*a, *b]);
            if pair.overlap(&rest).is_none() {
                found.push(pair);
            }
        }
    }
    found
}

/// A box is as thick as the mean of its two shorter sides.
fn piece(body: usize, shape: &Shape) -> Piece {
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
    Piece { body, ends, radius }
}

impl Piece {
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
        // Axes that cross have no side to go to.
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
    let share = |value: f64, of: f64| {
        if of > 1e-12 {
            (value / of).clamp(0.0, 1.0)
        } else {
            0.0
        }
    };
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
