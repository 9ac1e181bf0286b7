//! What both readers of FBX, ours and `ufbx`, tell of a file.

use super::settings::Settings;
use crate::clip::Problem;
use crate::import::bind::{Binds, Stand, pose};
use crate::import::scene::{Contents, Node, Scene, Take};
use nalgebra::Matrix4;

/// What a file of these settings holds.
pub(super) fn contents(
    settings: Settings,
    nodes: Vec<Node>,
    takes: Vec<Take>,
    more_problems: Vec<Problem>,
) -> Contents {
    let mut problems = settings.problems;
    problems.extend(more_problems);
    Contents {
        up_axis: settings.up_axis,
        unit_m: settings.unit_m,
        canonical_from_file: settings.canonical_from_file,
        problems,
        ..Contents::new("fbx", nodes, takes)
    }
}

/// Takes a bind pose as the rest pose of a scene whose nodes stand in another. A root keeps its heading: bind poses are
/// often kept in the axes of the tool that the character was modelled in.
pub(super) fn bound<S: Scene>(
    scene: &S,
    binds: Vec<Binds>,
) -> Option<(Vec<Matrix4<f64>>, Problem)> {
    if binds.is_empty() {
        return None;
    }
    let contents = scene.contents();
    let stand = Stand {
        nodes: &contents.nodes,
        world: &scene.placed(None),
        up: Some(contents.canonical_from_file.row(2).transpose()),
    };
    pose(&stand, binds.into_iter())
}

/// A warning about what neither reader evaluates.
pub(super) fn constraints_left_out() -> Problem {
    let message = "constraints aren't evaluated; bake the animation before exporting if the motion looks wrong";
    Problem::warning("constraints-left-out", message)
}
