//! What is kept of an episode in which a character is steered.

use crate::humanoid::Slot;
use crate::sim::LinkState;
use crate::task::{CharacterModel, Dynamics, Environment, SolePoint, Wish};
use nalgebra::{Point3, Unit, UnitQuaternion, Vector2, Vector3};

/// A character at the end of a control step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shot {
    /// Centre of mass over the ground, metres, and its velocity, m/s.
    pub place: Vector2<f64>,
    pub velocity: Vector2<f64>,
    /// Unit vector along the ground to where the head faces.
    pub facing: Vector2<f64>,
    /// How far the standing feet have slid since the step before, metres; `None` for a foot that doesn't stand.
    pub slide: [Option<f64>; 2],
}

/// What is kept of an episode.
#[derive(Clone, Debug, Default)]
pub(super) struct Take {
    /// What was asked for in each control step.
    pub wishes: Vec<Wish>,
    /// The simulated character.
    pub agent: Vec<Shot>,
    /// The animated one.
    pub reference: Vec<Shot>,
    /// Mean distance of the bodies from the animated character's, seen from the root, metres.
    pub errors: Vec<f64>,
    /// Whether the animated character's left foot came down in the step.
    pub strikes: Vec<bool>,
    /// Whether the agent fell.
    pub fell: bool,
}

/// Takes shots of a character.
pub(super) struct Camera<'a> {
    model: &'a CharacterModel,
    /// The body that shows where a character looks, and its forward direction.
    head: usize,
    forward: Unit<Vector3<f32>>,
    /// The feet's links, their numbers among the contact bodies and their soles.
    feet: [Option<Foot<'a>>; 2],
}

struct Foot<'a> {
    contact: usize,
    link: usize,
    sole: Vec<&'a SolePoint>,
}

/// The states of one character in two steps.
struct Moved<'a> {
    before: Option<&'a [LinkState]>,
    now: &'a [LinkState],
}

impl<'a> Camera<'a> {
    /// A camera for characters of this model.
    pub fn new(model: &'a CharacterModel) -> Camera<'a> {
        let slots = &model.skeleton.slots;
        let head = [Slot::Head, Slot::Chest].iter().find_map(|s| slots.get(s));
        let head = head.copied().unwrap_or(0);
        let rest = model.skeleton.forward(&model.skeleton.rest_qpos());
        let upright: UnitQuaternion<f32> = rest[head].rotation.cast();
        let foot = |slot| {
            let body = *slots.get(&slot)?;
            let link = model.character.bodies[body].link;
            Some(Foot {
                contact: model.contact(body)?,
                link,
                sole: model.soles.iter().filter(|p| p.link == link).collect(),
            })
        };
        Camera {
            head,
            forward: Unit::new_normalize(upright.inverse() * Vector3::x()),
            feet: [foot(Slot::LeftFoot), foot(Slot::RightFoot)],
            model,
        }
    }

    /// Keeps the end of a step. `before` are agent and animated character at its beginning, with the latter's contacts.
    pub fn keep(&self, take: &mut Take, environment: &dyn Environment, before: &Before) {
        let Some(reference) = environment.reference() else {
            return;
        };
        let agent = environment.world().states();
        take.wishes.push(before.wish);
        let own = Moved {
            before: before.agent.as_deref(),
            now: agent,
        };
        let touching = [&before.touching[..], environment.touching()];
        take.agent
            .push(self.shot(&own, environment.dynamics(), touching));
        let animated = Moved {
            before: before.reference.as_deref(),
            now: &reference.links,
        };
        let stands = [&before.stands[..], &reference.contacts];
        take.reference
            .push(self.shot(&animated, &reference.dynamics, stands));
        take.errors.push(self.error(agent, &reference.links));
        let left = self.feet[0].as_ref().map(|foot| foot.contact);
        let strikes = left.is_some_and(|c| {
            let was = before.stands.get(c).copied().unwrap_or(true);
            reference.contacts[c] && !was
        });
        take.strikes.push(strikes);
    }

    fn shot(&self, links: &Moved, dynamics: &Dynamics, contacts: [&[bool]; 2]) -> Shot {
        let head = self.model.character.body_pose(links.now, self.head);
        let ahead = (head.rotation * self.forward.as_ref()).xy().cast::<f64>();
        let slide = [0, 1].map(|i| {
            let foot = self.feet[i].as_ref()?;
            let stands = contacts
                .iter()
                .all(|c| c.get(foot.contact).copied().unwrap_or(false));
            let before = links.before.filter(|_| stands)?;
            Some(foot.slide(before, links.now))
        });
        Shot {
            place: dynamics.com.xy().cast(),
            velocity: dynamics.com_velocity.xy().cast(),
            facing: ahead.try_normalize(1e-6).unwrap_or_else(Vector2::x),
            slide,
        }
    }

    /// Mean distance of the bodies, seen from the root, metres.
    fn error(&self, agent: &[LinkState], reference: &[LinkState]) -> f64 {
        let root = |links: &[LinkState]| links[0].pose.translation.vector;
        let (mine, other) = (root(agent), root(reference));
        let pairs = self
            .model
            .positions(agent)
            .zip(self.model.positions(reference));
        let apart = pairs.map(|(a, b)| f64::from(((a - mine) - (b - other)).norm()));
        apart.sum::<f64>() / self.model.character.bodies.len() as f64
    }
}

impl Foot<'_> {
    /// How far the lowest point of the sole has gone over the ground, metres.
    fn slide(&self, before: &[LinkState], now: &[LinkState]) -> f64 {
        let (from, to) = (&before[self.link].pose, &now[self.link].pose);
        let height = |p: &&SolePoint| (to * Point3::from(p.center)).z - p.radius;
        let lowest = self
            .sole
            .iter()
            .copied()
            .min_by(|a, b| height(a).total_cmp(&height(b)));
        lowest.map_or(0.0, |p| {
            let at = Point3::from(p.center);
            f64::from((to * at - from * at).xy().norm())
        })
    }
}

/// A moment of an environment, to compare the next one with.
#[derive(Clone, Debug, Default)]
pub(super) struct Before {
    wish: Wish,
    agent: Option<Vec<LinkState>>,
    touching: Vec<bool>,
    reference: Option<Vec<LinkState>>,
    stands: Vec<bool>,
}

impl Before {
    /// The environment as it is now.
    pub fn of(environment: &dyn Environment) -> Before {
        let reference = environment.reference();
        Before {
            wish: environment.wish().unwrap_or_default(),
            agent: Some(environment.world().states().to_vec()),
            touching: environment.touching().to_vec(),
            stands: reference
                .as_ref()
                .map_or_else(Vec::new, |r| r.contacts.clone()),
            reference: reference.map(|r| r.links),
        }
    }
}
