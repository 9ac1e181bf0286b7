//! What each motion is for, where a character is steered.

use crate::prepare::Preparation;
use crate::printer::Printer;
use mimic::motion::Motion;
use mimic::skeleton::Skeleton;
use mimic::task::{Role, Traits};

/// Says of every motion what was found in it.
pub fn say(
    preparations: &[Preparation],
    motions: &[Motion],
    skeleton: &Skeleton,
    printer: &Printer,
) {
    for (preparation, motion) in preparations.iter().zip(motions) {
        let found = text(&Traits::of(motion, skeleton));
        printer.note(format!("`{}` {found}", preparation.file.display()));
    }
}

/// What a motion does, and what it is used for.
fn text(found: &Traits) -> String {
    let speed = found.velocity.norm();
    match found.role {
        Role::Idle => "stands".to_owned(),
        Role::Gait => {
            let way = Role::direction_name(&found.velocity);
            format!("goes {way} at {speed:.2} m/s")
        }
        Role::Turn => {
            let side = if found.turn > 0.0 { "left" } else { "right" };
            let degrees = found.turn.to_degrees().abs();
            format!(
                "turns by {degrees:.0}° to the {side}; it isn't used yet, for turns are made from steps"
            )
        }
        Role::Extra => "neither stands nor goes on and on; it isn't used yet".to_owned(),
    }
}
