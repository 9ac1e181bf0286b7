//! Legs that reach for where their feet are to be.

use super::pose::{Pose, Tree};
use crate::humanoid::Slot;
use crate::sim::LinkJoint;
use crate::task::model::CharacterModel;
use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};

/// How straight a leg may become: the cosine of the least bend of its knee. Chosen: 5°, so that knees don't snap.
const STRAIGHT: f32 = 0.996;

/// A leg, with its three links.
#[derive(Clone, Debug)]
pub(super) struct Leg {
    thigh: usize,
    shin: usize,
    /// The link of the foot.
    pub foot: usize,
    /// The axis of a knee that is a hinge, in the shin's frame, about which it bends by positive angles.
    axis: Option<Vector3<f32>>,
    /// The balls whose hull is the sole: centres in the foot's frame and radii, metres.
    sole: Vec<(Point3<f32>, f32)>,
    /// Where the foot points in the rest pose, in its own frame.
    forward: Vector3<f32>,
}

impl Leg {
    /// The left and the right leg; `None` for a skeleton without one.
    pub fn both(model: &CharacterModel) -> Option<[Leg; 2]> {
        use Slot::*;
        let left = Leg::new(model, [LeftUpperLeg, LeftLowerLeg, LeftFoot])?;
        let right = Leg::new(model, [RightUpperLeg, RightLowerLeg, RightFoot])?;
        Some([left, right])
    }

    fn new(model: &CharacterModel, slots: [Slot; 3]) -> Option<Leg> {
        let (skeleton, character) = (&model.skeleton, &model.character);
        let link = |slot| Some(character.bodies[*skeleton.slots.get(&slot)?].link);
        let [thigh, shin, foot] = slots.map(link);
        let (thigh, shin, foot) = (thigh?, shin?, foot?);
        let axis = match &character.links[shin].joint {
            LinkJoint::Hinge { axis, .. } => {
                let [least, most] = axis.limit;
                let side = if most > -least { 1.0 } else { -1.0 };
                Some(axis.direction.cast() * side)
            }
            _ => None,
        };
        let points = model.soles.iter().filter(|point| point.link == foot);
        let sole: Vec<_> = points.map(|p| (Point3::from(p.center), p.radius)).collect();
        let rest = skeleton.forward(&skeleton.rest_qpos());
        let upright = rest[character.links[foot].body].rotation.cast::<f32>();
        let forward = upright.inverse() * Vector3::x();
        (!sole.is_empty()).then_some(Leg {
            thigh,
            shin,
            foot,
            axis,
            sole,
            forward,
        })
    }

    /// The first of its links.
    pub fn first(&self) -> usize {
        self.thigh
    }

    /// The lowest point of the sole of a foot in this pose: where it is in the foot's frame, and its height, metres.
    pub fn lowest(&self, foot: &Isometry3<f32>) -> (Point3<f32>, f32) {
        let height = |(center, radius): &(Point3<f32>, f32)| (foot * center).z - radius;
        let points = self.sole.iter().map(|ball| (ball.0, height(ball)));
        let lowest = points.min_by(|a, b| a.1.total_cmp(&b.1));
        lowest.unwrap_or((Point3::origin(), 0.0))
    }

    /// The direction along the ground to which a foot of this orientation points, radians.
    pub fn heading(&self, turn: &UnitQuaternion<f32>) -> f32 {
        let ahead = turn * self.forward;
        ahead.y.atan2(ahead.x)
    }

    /// How much lower the hip has to be for the foot to come to `foot`, metres; 0 where the leg is long enough.
    pub fn short_by(&self, tree: &Tree, poses: &[Isometry3<f32>], foot: &Isometry3<f32>) -> f32 {
        let bend = self.bend(tree, poses);
        let hip = self.hip(tree, poses);
        let way = (foot * tree.joint_in_link(self.foot)) - hip;
        let longest = bend.longest();
        let beyond = way.xy().norm();
        // The highest place from which the leg reaches; where it never does, half its length above the ankle.
        let height = (longest * longest - beyond * beyond).max(longest * longest / 4.0);
        (-way.z - height.sqrt()).max(0.0)
    }

    /// Turns hip, knee and ankle so that the foot comes to `foot`, or as near to it as the leg is long. `poses` are where the links
    /// are in `pose`; those of the leg have to be placed anew.
    pub fn reach(
        &self,
        tree: &Tree,
        pose: &mut Pose,
        poses: &[Isometry3<f32>],
        foot: &Isometry3<f32>,
    ) {
        let bend = self.bend(tree, poses);
        let way = (foot * tree.joint_in_link(self.foot)) - self.hip(tree, poses);
        let knee = bend.to(way.norm());
        let (thigh, shin) = (poses[self.thigh].rotation, poses[self.shin].rotation);
        // The leg as bent, turned the short way to where the ankle is to be.
        let now = thigh * (bend.upper + knee * bend.lower);
        let swing = UnitQuaternion::rotation_between(&now, &way);
        let new_thigh = swing.unwrap_or_else(UnitQuaternion::identity) * thigh;
        let new_shin = new_thigh * knee * (thigh.inverse() * shin);
        // A link between two of them keeps its place on the upper one.
        let carried = |link: usize, from: UnitQuaternion<f32>, to: UnitQuaternion<f32>| {
            let parent = tree.parent(link).map_or(from, |p| poses[p].rotation);
            to * from.inverse() * parent * tree.rest(link)
        };
        let hip = tree.parent(self.thigh).map_or(thigh, |p| poses[p].rotation);
        pose.joints[self.thigh] = (hip * tree.rest(self.thigh)).inverse() * new_thigh;
        pose.joints[self.shin] = carried(self.shin, thigh, new_thigh).inverse() * new_shin;
        pose.joints[self.foot] = carried(self.foot, shin, new_shin).inverse() * foot.rotation;
    }

    /// Where the hip is.
    fn hip(&self, tree: &Tree, poses: &[Isometry3<f32>]) -> Point3<f32> {
        poses[self.thigh] * tree.joint_in_link(self.thigh)
    }

    /// How the knee is bent.
    fn bend(&self, tree: &Tree, poses: &[Isometry3<f32>]) -> Bend {
        let (thigh, shin) = (&poses[self.thigh], &poses[self.shin]);
        let knee = shin * tree.joint_in_link(self.shin);
        let ankle = poses[self.foot] * tree.joint_in_link(self.foot);
        let into = thigh.rotation.inverse();
        let (upper, lower) = (into * (knee - self.hip(tree, poses)), into * (ankle - knee));
        let hinge = self.axis.map(|axis| into * (shin.rotation * axis));
        // A knee that bends any way goes on bending as it does.
        let across = || upper.cross(&lower).try_normalize(1e-6);
        let axis = hinge.or_else(across).unwrap_or_else(Vector3::y);
        Bend {
            upper,
            lower,
            axis: Unit::new_normalize(axis),
        }
    }
}

/// Both halves of a leg in the thigh's frame, metres, and the axis about which the lower one turns.
struct Bend {
    upper: Vector3<f32>,
    lower: Vector3<f32>,
    axis: Unit<Vector3<f32>>,
}

impl Bend {
    /// Longest distance from hip to ankle.
    fn longest(&self) -> f32 {
        let [along, across, fixed] = self.parts();
        let sizes = self.upper.norm_squared() + self.lower.norm_squared();
        (sizes + 2.0 * (along.hypot(across) * STRAIGHT + fixed)).sqrt()
    }

    /// u·R(δ)l = along cos δ + across sin δ + fixed, for a turn by δ of the lower half l against the upper one u.
    fn parts(&self) -> [f32; 3] {
        let (u, l, n) = (&self.upper, &self.lower, self.axis.as_ref());
        let fixed = n.dot(l) * n.dot(u);
        [u.dot(l) - fixed, u.dot(&n.cross(l)), fixed]
    }

    /// The turn of the knee after which the ankle is so far from the hip, the nearer of the two: |u + R(δ)l|² = d².
    fn to(&self, distance: f32) -> UnitQuaternion<f32> {
        let [along, across, fixed] = self.parts();
        let sizes = self.upper.norm_squared() + self.lower.norm_squared();
        let wanted = (distance * distance - sizes) / 2.0 - fixed;
        let reach = along.hypot(across).max(f32::MIN_POSITIVE);
        let middle = across.atan2(along);
        let side = (wanted / reach).clamp(-1.0, STRAIGHT).acos();
        // `middle` is where the leg is straight; beyond it the knee bends by a positive angle.
        UnitQuaternion::from_axis_angle(&self.axis, middle + side)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::skeleton::Skeleton;
    use nalgebra::Translation3;

    fn model(name: &str) -> CharacterModel {
        let skeleton = Skeleton::load(name).expect("the character loads");
        CharacterModel::new(skeleton).expect("it can be simulated")
    }

    /// The sole is where it was to be, and the knee bends forward as before.
    #[test]
    fn feet_come_to_where_they_are_to_be() {
        for name in ["humanoid", "marathon", "robot"] {
            let model = model(name);
            let (tree, legs) = (Tree::new(&model.character), Leg::both(&model));
            let legs = legs.expect("it has legs");
            let qpos = model.skeleton.rest_qpos();
            let still = vec![0.0; model.skeleton.nv];
            let links = model.character.states(&model.skeleton, &qpos, &still);
            let mut pose = Pose::of(&model.character, &links, &Isometry3::identity());
            // A little lower, so that both legs are bent.
            pose.root.translation.z -= 0.1;
            let mut poses: Vec<_> = links.iter().map(|link| link.pose).collect();
            for leg in &legs {
                tree.place(&pose, &mut poses, 0);
                let by = Translation3::new(0.12, 0.03, 0.16);
                let turn = UnitQuaternion::from_euler_angles(0.05, 0.2, 0.1);
                let wanted = by * poses[leg.foot] * turn;
                leg.reach(&tree, &mut pose, &poses, &wanted);
                tree.place(&pose, &mut poses, 0);
                let found = poses[leg.foot];
                let apart = (found.translation.vector - wanted.translation.vector).norm();
                let angle = found.rotation.angle_to(&wanted.rotation);
                assert!(
                    apart < 2e-4 && angle < 2e-3,
                    "{name}: {apart} m, {angle} rad"
                );
                let knee = poses[leg.shin] * tree.joint_in_link(leg.shin);
                let ankle = found * tree.joint_in_link(leg.foot);
                let hip = leg.hip(&tree, &poses);
                let middle = (hip.x + ankle.x) / 2.0;
                assert!(knee.x > middle, "{name}: the knee bends forward");
            }
        }
    }
}
