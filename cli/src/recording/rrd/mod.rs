//! What the rerun viewer shows of a recording: the scene, the curves beside it, and the layout of both.

mod blueprint;
mod look;
mod names;
mod series;
#[cfg(test)]
mod tests;
mod world;

use crate::output::recording_id;
use crate::recording::content::{Recording, Sink};
use names::{APPLICATION, TIMELINE};
use rerun::external::re_log_types::StoreId;
use rerun::{
    RecordingStream, RecordingStreamBuilder, RecordingStreamResult, StoreKind, TimeColumn,
};
use std::time::Duration;

/// How long a viewer may take to receive a whole recording; on one machine that is well below a second.
const FLUSH: Duration = Duration::from_secs(30);

/// Writes the whole recording and waits until it has arrived.
///
/// # Errors
/// A file that cannot be written, or a viewer that goes away.
pub fn write(shown: &Recording, sink: &Sink) -> Result<(), Box<dyn std::error::Error>> {
    // The user asked for a recording, so it is written even where the variable RERUN turns the SDK off.
    let mut builder = RecordingStreamBuilder::new(APPLICATION)
        .recording_name(&shown.name)
        .enabled(true);
    if let Sink::File {
        made: Some(made), ..
    } = sink
    {
        // Two recordings of one id would be one to the viewer, so its end is random. Who sets an id is taken for one of
        // several writers, and has to say that it sends the name.
        let random = StoreId::random(StoreKind::Recording, APPLICATION);
        let id = format!("{}{}", recording_id(made), random.recording_id());
        builder = builder.recording_id(id).send_properties(true);
    }
    let stream = match sink {
        Sink::File { path, .. } => builder.save(path)?,
        Sink::Viewer(address) => builder.connect_grpc_opts(address)?,
    };
    log(&stream, shown)?;
    Ok(stream.flush_with_timeout(FLUSH)?)
}

fn log(stream: &RecordingStream, shown: &Recording) -> RecordingStreamResult<()> {
    blueprint::send(stream, shown)?;
    let frames = shown.frames();
    let seconds = (0..frames).map(|f| f as f64 / shown.fps);
    let times = [
        TimeColumn::new_duration_secs(TIMELINE, seconds),
        TimeColumn::new_sequence("frame", 0..frames as i64),
    ];
    world::log(stream, shown, &times)?;
    series::log(stream, shown, &times)
}
