//! Where a recording goes.

use super::{Recording, blueprint, scene, series};
use rerun::{RecordingStream, RecordingStreamBuilder, RecordingStreamResult, TimeColumn};
use std::path::PathBuf;
use std::time::Duration;

pub const APPLICATION: &str = "mimic";
/// Seconds from the first frame.
pub const TIMELINE: &str = "time";

/// How long a viewer may take to receive everything.
const FLUSH: Duration = Duration::from_secs(30);

pub enum Sink {
    File(PathBuf),
    /// A viewer that listens, e.g. `rerun+http://127.0.0.1:9876/proxy`.
    Viewer(String),
}

/// Writes the whole recording and waits until it is there.
pub fn write(shown: &Recording, sink: &Sink) -> Result<(), Box<dyn std::error::Error>> {
    // Somebody asked for it, whatever the variable RERUN says.
    let builder = RecordingStreamBuilder::new(APPLICATION)
        .recording_name(&shown.name)
        .enabled(true);
    let stream = match sink {
        Sink::File(path) => builder.save(path)?,
        Sink::Viewer(address) => builder.connect_grpc_opts(address)?,
    };
    log(&stream, shown)?;
    Ok(stream.flush_with_timeout(FLUSH)?)
}

fn log(stream: &RecordingStream, shown: &Recording) -> RecordingStreamResult<()> {
    blueprint::send(stream, shown)?;
    let frames = shown.phase.len();
    let seconds = (0..frames).map(|f| f as f64 / shown.fps);
    let times = [
        TimeColumn::new_duration_secs(TIMELINE, seconds),
        TimeColumn::new_sequence("frame", 0..frames as i64),
    ];
    scene::log(stream, shown, &times)?;
    series::log(stream, shown, &times)
}
