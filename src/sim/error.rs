//! Why a skeleton can't be simulated, and how a simulation ends early.

use crate::explain::{Explain, Explanation, explained};

/// The state stopped being finite or left the world; the episode has to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Diverged;

impl Explain for Diverged {
    fn explain(&self) -> Explanation {
        Explanation::work("the simulation diverged")
            .remedy("raise the physics rate, or lower the stiffness and force limits of the drives")
    }
}

explained!(Diverged);

/// Why a skeleton can't be simulated. The skeleton itself is sound: it can still be used for retargeting.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SimError {
    /// A slide joint.
    SlideJoint {
        /// Name of the body.
        body: String,
        /// Name of its joint.
        joint: String,
    },
    /// More joints on one body than one ball joint or three hinges.
    TooManyJoints {
        /// Name of the body.
        body: String,
        /// How many joints it has.
        count: usize,
    },
    /// Two neighbouring hinges of one body about the same axis.
    ParallelHinges {
        /// Name of the body.
        body: String,
    },
    /// A root body with other joints than one free joint.
    RootIsNotFree {
        /// Name of the body.
        body: String,
    },
    /// A second body without a parent.
    SecondRoot {
        /// Name of the body.
        body: String,
    },
    /// A body that moves and has no mass.
    Massless {
        /// Name of the body.
        body: String,
    },
    /// A joint that nothing drives, in a character for a policy.
    Undriven {
        /// Name of the body.
        body: String,
        /// Name of its joint.
        joint: String,
    },
    /// A skeleton without bodies.
    Empty,
}

impl Explain for SimError {
    fn explain(&self) -> Explanation {
        let of_body =
            |body: &str, cause: &str| Explanation::input(cause).place(format!("body `{body}`"));
        match self {
            Self::SlideJoint { body, joint } => {
                Explanation::input("a slide joint cannot be simulated")
                    .place(format!("joint `{joint}` of body `{body}`"))
                    .remedy("make it a hinge or a ball joint, or weld the body to its parent")
            }
            Self::TooManyJoints { body, count } => of_body(
                body,
                &format!("its {count} joints cannot be simulated together"),
            )
            .remedy("give the body one ball joint or up to three hinges"),
            Self::ParallelHinges { body } => {
                of_body(body, "two of its hinges turn about the same axis")
                    .remedy("replace the two hinges with one")
            }
            Self::RootIsNotFree { body } => of_body(body, "the root does not move freely")
                .remedy("give the root body a free joint and no other"),
            Self::SecondRoot { body } => of_body(body, "a second root cannot be simulated")
                .remedy("keep one character in the skeleton, with all its bodies under one root"),
            Self::Massless { body } => of_body(body, "it moves but has no mass")
                .remedy("give the body a geom or an <inertial>"),
            Self::Undriven { body, joint } => Explanation::input(
                "nothing drives this joint or any other, so no policy can move the character",
            )
            .place(format!("joint `{joint}` of body `{body}`"))
            .remedy("give the joints <position> actuators"),
            Self::Empty => Explanation::input("the skeleton has no bodies")
                .remedy("add a body with a free joint"),
        }
    }
}

explained!(SimError);
