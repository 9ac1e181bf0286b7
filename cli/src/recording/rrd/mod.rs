//! What the rerun viewer shows of a recording: the scene, the curves beside it, and the layout of both.

mod blueprint;
mod look;
mod names;
mod series;
#[cfg(test)]
mod tests;
mod world;

use crate::output::recording_id;
use crate::recording::content::Recording;
use names::{APPLICATION, TIMELINE};
use rerun::external::re_log_types::StoreId;
use rerun::{
    RecordingStream, RecordingStreamBuilder, RecordingStreamResult, StoreKind, TimeColumn,
};
use std::error::Error;
use std::time::Duration;

/// How long a viewer may take to receive a whole recording; on one machine that is well below a second.
const FLUSH: Duration = Duration::from_secs(30);

/// The bytes of a file with the recording, whose id says what made it. They are collected in memory, where all of the
/// recording is already: the library's own files wait for ever on a disk that is full.
///
/// # Errors
/// Data that the library doesn't take.
pub fn bytes(shown: &Recording, made: Option<&str>) -> Result<Vec<u8>, Box<dyn Error>> {
    let mut builder = builder(shown);
    if let Some(made) = made {
        // Two recordings of one id would be one to the viewer, so its end is random. Who sets an id is taken for one of
        // several writers, and has to say that it sends the name.
        let random = StoreId::random(StoreKind::Recording, APPLICATION);
        let id = format!("{}{}", recording_id(made), random.recording_id());
        builder = builder.recording_id(id).send_properties(true);
    }
    let (stream, storage) = builder.memory()?;
    log(&stream, shown)?;
    Ok(storage.drain_as_bytes()?)
}

/// Sends the whole recording to the viewer at `address`, such as `rerun+http://127.0.0.1:9876/proxy`, and waits until it has
/// arrived.
///
/// # Errors
/// A viewer that goes away.
pub fn send(shown: &Recording, address: &str) -> Result<(), Box<dyn Error>> {
    let stream = builder(shown).connect_grpc_opts(address)?;
    log(&stream, shown)?;
    Ok(stream.flush_with_timeout(FLUSH)?)
}

/// The user asked for a recording, so it is made even where the variable RERUN turns the library off.
fn builder(shown: &Recording) -> RecordingStreamBuilder {
    RecordingStreamBuilder::new(APPLICATION)
        .recording_name(&shown.name)
        .enabled(true)
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
