//! Trains a policy that performs an animation clip under physics: from a clip to a policy in about twenty lines.
//!
//! `cargo run --release --example train CLIP RUN [SAMPLES]`
//!
//! RUN is the folder to write, and SAMPLES the number of control steps to learn from, by default that of the preset. To
//! watch the policy: `mimic replay RUN --rerun`.

use mimic::import;
use mimic::retarget::{self, retarget};
use mimic::run::{Run, Session, preset};
use mimic::skeleton::Skeleton;
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let usage = "usage: train CLIP RUN [SAMPLES]";
    let (clip, folder) = (args.next().ok_or(usage)?, args.next().ok_or(usage)?);

    // The reference motion. A policy learns it sooner where a body could perform it: hence `to_perform`.
    let clip = import::load(&clip, &import::Options::default())?;
    let preset = preset("default").ok_or("there is no such preset")?;
    let skeleton = Skeleton::load(preset.skeleton)?;
    let options = retarget::Options {
        to_perform: true,
        ..Default::default()
    };
    let motion = retarget(&clip, &skeleton, &options)?.motion;

    // What is learned, and how: any field of the plan can be changed here.
    let mut plan = (preset.plan)();
    if let Some(samples) = args.next() {
        plan.samples = samples.parse()?;
    }

    // A round ends where no episode is under way. The run is saved there, and a session that is opened on it later goes
    // on to the same bits.
    let mut session = Session::open(Run::create(&folder, plan, skeleton, vec![motion])?)?;
    while !session.is_done() {
        let round = session.train_round()?;
        if let Some(last) = round.last() {
            let length = last.metrics.episode_length.unwrap_or_default();
            println!(
                "{} samples: episodes of {length:.2} s",
                last.metrics.samples
            );
        }
    }

    for case in session.finish(&mimic::evaluate::Options::default())? {
        let survival = case.evaluation.measure("survival").unwrap_or_default();
        println!(
            "{}: performs {:.0} % of the motion",
            case.motion,
            100.0 * survival
        );
    }
    Ok(())
}
