//! The curves beside the scene.

use super::look::{self, Rgba};
use crate::recording::content::Recording;
use rerun::{
    RecordingStream, RecordingStreamResult, Scalars, SeriesLines, StateChange, StateConfiguration,
    TimeColumn,
};

/// The state of a body that touches the ground.
const DOWN: &str = "down";

/// Logs everything below `plots`.
pub fn log(
    stream: &RecordingStream,
    shown: &Recording,
    times: &[TimeColumn],
) -> RecordingStreamResult<()> {
    // A task without a reference has no phase.
    if !shown.phase.is_empty() {
        let phase = shown.phase.iter().copied();
        line(stream, "plots/phase", "phase", look::PHASE, phase, times)?;
    }
    for (index, term) in shown.rewards.iter().enumerate() {
        let path = format!("plots/rewards/{}", term.name);
        let values = term.values.iter().copied();
        line(stream, &path, &term.name, look::curve(index), values, times)?;
    }
    for (name, actor) in shown.actors() {
        let color = look::of_actor(name);
        let height = actor.com.iter().map(|com| com.z);
        line(
            stream,
            &format!("plots/com_height/{name}"),
            name,
            color,
            height,
            times,
        )?;
        let momentum = actor.angular_momentum.iter().map(|l| l.norm());
        line(
            stream,
            &format!("plots/angular_momentum/{name}"),
            name,
            color,
            momentum,
            times,
        )?;
    }
    contacts(stream, shown, times)
}

fn line(
    stream: &RecordingStream,
    path: &str,
    name: &str,
    color: Rgba,
    values: impl Iterator<Item = f64>,
    times: &[TimeColumn],
) -> RecordingStreamResult<()> {
    let style = SeriesLines::new()
        .with_colors([look::color(color)])
        .with_widths([2.0])
        .with_names([name]);
    stream.log_static(path, &style)?;
    let values: Vec<f64> = values.collect();
    let columns = Scalars::update_fields()
        .with_scalars(values)
        .columns_of_unit_batches()?;
    stream.send_columns(path, times.to_vec(), columns)
}

/// Draws a lane for every body that ever touches the ground, filled while it does.
fn contacts(
    stream: &RecordingStream,
    shown: &Recording,
    times: &[TimeColumn],
) -> RecordingStreamResult<()> {
    for (name, actor) in shown.actors() {
        for contact in shown.contacts() {
            let path = format!("plots/contacts/{}/{name}", shown.name_of_contact(contact));
            let style = StateConfiguration::new()
                .with_values([DOWN])
                .with_labels([name])
                .with_colors([look::color(look::of_actor(name))]);
            stream.log_static(path.as_str(), &style)?;
            let touches = |frame: &Vec<bool>| frame.get(contact).is_some_and(|t| *t);
            let states = actor
                .contact
                .iter()
                .map(|f| if touches(f) { DOWN } else { "" });
            let columns = StateChange::update_fields()
                .with_state(states)
                .columns_of_unit_batches()?;
            stream.send_columns(path, times.to_vec(), columns)?;
        }
    }
    Ok(())
}
