//! The bodies with which a character can touch the ground. They belong to the character, whatever it is to do.

use crate::humanoid::Slot;
use crate::sim::{Attachment, Character, LinkState};
use crate::skeleton::{Shape, Skeleton};
use nalgebra::Point3;

/// Height of a body's lowest point up to which it counts as the one that presses, where several share a link, metres. Chosen:
/// shapes sink in by less.
const PRESSES: f32 = 0.01;

/// A body with shapes.
#[derive(Clone, Debug)]
pub struct ContactBody {
    /// Its index in the skeleton.
    pub body: usize,
    /// The link that carries it.
    pub link: usize,
    /// Whether it is a foot or a hand, or hangs on one.
    pub is_end: bool,
    /// Whether it is a foot, or hangs on one.
    pub is_foot: bool,
    /// Whether it alone of its link has shapes.
    is_alone: bool,
    /// The balls whose hull it is: centres in the link's frame and radii, metres.
    balls: Vec<(Point3<f32>, f32)>,
}

impl ContactBody {
    /// All of a character, in the order of [`Skeleton::contact_bodies`].
    pub(crate) fn all(skeleton: &Skeleton, character: &Character) -> Vec<Self> {
        let bodies = skeleton.contact_bodies();
        let feet = below(skeleton, [Slot::LeftFoot, Slot::RightFoot]);
        let hands = below(skeleton, [Slot::LeftHand, Slot::RightHand]);
        let link = |body: usize| character.bodies[body].link;
        let one = |&body: &usize| {
            let Attachment { link_from_body, .. } = character.bodies[body];
            let shapes = skeleton.bodies[body].shapes.iter();
            let balls = shapes.flat_map(Shape::hull_balls);
            Self {
                body,
                link: link(body),
                is_end: feet[body] || hands[body],
                is_foot: feet[body],
                is_alone: bodies.iter().filter(|b| link(**b) == link(body)).count() == 1,
                balls: balls
                    .map(|(c, r)| ((link_from_body * c).cast(), r as f32))
                    .collect(),
            }
        };
        bodies.iter().map(one).collect()
    }

    /// Height of its lowest point, metres.
    pub fn lowest(&self, links: &[LinkState]) -> f32 {
        let pose = &links[self.link].pose;
        let height = |(center, radius): &(Point3<f32>, f32)| (pose * center).z - radius;
        self.balls.iter().map(height).fold(f32::INFINITY, f32::min)
    }

    /// Whether it presses on the ground; `pressing` says it of the links.
    pub fn touches(&self, links: &[LinkState], pressing: &[bool]) -> bool {
        pressing[self.link] && (self.is_alone || self.lowest(links) < PRESSES)
    }
}

/// Which bodies are in one of these slots, or hang on one.
fn below(skeleton: &Skeleton, slots: [Slot; 2]) -> Vec<bool> {
    let tops = slots.map(|slot| skeleton.slots.get(&slot).copied());
    let mut below = vec![false; skeleton.bodies.len()];
    // Parents stand before their children.
    for (b, body) in skeleton.bodies.iter().enumerate() {
        below[b] = tops.contains(&Some(b)) || body.parent.is_some_and(|p| below[p]);
    }
    below
}

#[cfg(test)]
mod tests {
    use crate::skeleton::Skeleton;
    use crate::task::CharacterModel;
    use nalgebra::Vector3;

    /// A forearm and the hand that is welded to it are one link; only the lower one presses on the ground.
    #[test]
    fn of_two_bodies_on_one_link_the_lower_one_touches() {
        let skeleton = Skeleton::load("humanoid").expect("the built-in humanoid loads");
        let model = CharacterModel::new(skeleton).expect("it can be simulated");
        let (rest, still) = (model.skeleton.rest_qpos(), vec![0.0; model.skeleton.nv]);
        let mut links = model.character.states(&model.skeleton, &rest, &still);
        let contact = |name: &str| {
            let body = model.skeleton.bodies.iter().position(|b| b.name == name);
            let number = model.contact(body.expect("a body of that name"));
            &model.contacts[number.expect("it has a shape")]
        };
        let (hand, arm) = (contact("left_hand"), contact("left_lower_arm"));
        assert_eq!(hand.link, arm.link);
        // The arms hang, so the whole character goes down until the hand is on the ground.
        let down = Vector3::z() * hand.lowest(&links);
        links
            .iter_mut()
            .for_each(|link| link.pose.translation.vector -= down);
        let pressing = vec![true; links.len()];
        assert!(hand.touches(&links, &pressing) && !arm.touches(&links, &pressing));
        assert!(!hand.touches(&links, &vec![false; links.len()]));
        assert!(contact("left_foot").is_foot && !hand.is_foot && hand.is_end && !arm.is_end);
    }
}
