//! Damaged copies of real files: reading them never panics, ends soon, and takes no more memory than their size allows.
//!
//! `many_inputs` reads as many copies as `MIMIC_FUZZ_INPUTS` says, of the seed `MIMIC_FUZZ_SEED`, from number `MIMIC_FUZZ_FIRST`
//! on, of the kinds that `MIMIC_FUZZ_KINDS` lists, with commas between them. Those that fail are kept in `MIMIC_FUZZ_FOLDER`.

mod fbx;
mod glb;
mod heap;
mod json;
mod ours;
mod plain;
mod random;
mod runs;
mod seeds;
mod targets;
mod tensors;
mod text;

use mimic::clip::Joint;
use mimic::import::Options;
use random::Random;
use seeds::Seed;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::{Duration, Instant};
use targets::With;

/// Bytes that reading may take for each byte of a binary file and of a text, and for any file: a few bytes can ask for many
/// frames, and a reader's tables have the same size for every file.
const PER_BYTE: usize = 64;
const PER_LETTER: usize = 16;
const FREE: usize = 64 << 20;
/// How long reading any file may take, and how much longer for each MiB.
const SOON: Duration = Duration::from_secs(1);
/// A reading that takes this long counts as endless.
const NEVER: u64 = 120;
/// Failures after which a run stops.
const ENOUGH: usize = 100;

/// What was seen of one format.
#[derive(Default)]
struct Tally {
    inputs: u64,
    read: u64,
    longest: Duration,
    /// Most bytes in use at once, and most of them beyond what each byte of the file allows.
    peak: usize,
    excess: usize,
}

/// A fuzzing run.
struct Run {
    seeds: Vec<Seed>,
    kinds: Vec<&'static str>,
    seed: u64,
    /// A motion, beside which damaged skeletons are put.
    motion: Vec<u8>,
    /// The joints that damaged maps are for.
    joints: Vec<Joint>,
    /// For files that have to be on a disk.
    folder: tempfile::TempDir,
    kept: PathBuf,
    tallies: BTreeMap<&'static str, Tally>,
    failures: usize,
}

/// The input being read, and when that began, in seconds since the start.
static CURRENT: AtomicU64 = AtomicU64::new(0);
static BEGAN: AtomicU64 = AtomicU64::new(0);

/// Ends the program when one input takes too long.
fn watch(start: Instant) {
    std::thread::spawn(move || {
        loop {
            std::thread::sleep(Duration::from_secs(5));
            if start.elapsed().as_secs() > BEGAN.load(Relaxed) + NEVER {
                eprintln!("input {} doesn't end", CURRENT.load(Relaxed));
                std::process::exit(1);
            }
        }
    });
}

impl Run {
    fn new(seed: u64, kept: PathBuf) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let wanted = std::env::var("MIMIC_FUZZ_KINDS").ok();
        let wanted = |kind: &str| {
            let mut kinds = wanted.iter().flat_map(|list| list.split(','));
            wanted.is_none() || kinds.any(|name| name == kind)
        };
        let mut seeds = seeds::all();
        seeds.extend(seeds::of_run(folder.path()));
        let bytes = |kind: &str| {
            seeds
                .iter()
                .find(|s| s.kind == kind)
                .map(|s| s.bytes.clone())
        };
        if let Some(skeleton) = bytes("ASF") {
            std::fs::write(folder.path().join("01.asf"), skeleton).expect("it is written");
        }
        let motion = bytes("AMC").unwrap_or_default();
        let kinds = seeds.iter().map(|s| s.kind);
        let mut kinds: Vec<_> = kinds.filter(|kind| wanted(kind)).collect();
        kinds.sort_unstable();
        kinds.dedup();
        Self {
            tallies: kinds.iter().map(|kind| (*kind, Tally::default())).collect(),
            seeds,
            kinds,
            seed,
            motion,
            joints: ours::clip().joints,
            folder,
            kept,
            failures: 0,
        }
    }

    fn inputs(&mut self, numbers: std::ops::Range<u64>) {
        let start = Instant::now();
        watch(start);
        for input in numbers {
            CURRENT.store(input, Relaxed);
            BEGAN.store(start.elapsed().as_secs(), Relaxed);
            self.input(input);
            if (input + 1).is_multiple_of(20_000) {
                eprintln!("{} inputs, {:.0?}", input + 1, start.elapsed());
            }
            if self.failures >= ENOUGH {
                break;
            }
        }
        BEGAN.store(u64::MAX - NEVER, Relaxed);
    }

    fn input(&mut self, input: u64) {
        let mut random = Random::new(self.seed, input);
        let kind = *random.of(&self.kinds);
        let of_kind: Vec<&Seed> = self.seeds.iter().filter(|s| s.kind == kind).collect();
        let seed = *random.of(&of_kind);
        let bytes = seed.damaged(&mut random);
        let options = Options {
            mirror: random.one_in(8),
            ..Options::default()
        };
        let seen = self.seen(seed, &bytes, &options);
        let (name, size) = (seed.name.clone(), bytes.len() + seed.beside);
        let per_byte = if seed.is_text() { PER_LETTER } else { PER_BYTE };
        let excess = seen.peak.saturating_sub(per_byte * size);
        let soon = SOON.mul_f64(1.0 + size as f64 / f64::from(1 << 20));
        if let Some(tally) = self.tallies.get_mut(kind) {
            tally.inputs += 1;
            tally.read += u64::from(seen.read);
            tally.longest = tally.longest.max(seen.seconds);
            tally.peak = tally.peak.max(seen.peak);
            tally.excess = tally.excess.max(excess);
        }
        let slow = || (seen.seconds > soon).then(|| format!("it takes {:.1?}", seen.seconds));
        let large = || (excess > FREE).then(|| format!("{} bytes for {size}", seen.peak));
        if let Some(fault) = seen.fault.clone().or_else(slow).or_else(large) {
            self.keep(&format!("{}-{input}-{name}", self.seed), &bytes);
            eprintln!("input {input}, {name} ({kind}): {fault}");
        }
    }

    /// Reads a damaged copy of `seed`.
    fn seen(&self, seed: &Seed, bytes: &[u8], options: &Options) -> Seen {
        let (name, read) = match seed.kind {
            // A skeleton is read by way of a motion.
            "ASF" => {
                let path = self.folder.path().join("02.asf");
                std::fs::write(path, bytes).expect("it is written");
                ("02_01.amc", self.motion.as_slice())
            }
            _ => (seed.name.as_str(), bytes),
        };
        let folder = match seed.kind {
            "glTF" => &seed.folder,
            _ => self.folder.path(),
        };
        let with = With {
            folder,
            options,
            joints: &self.joints,
        };
        let mut seen = attempt(seed.kind, name, read, &with);
        // Other programs may have taken the time, so what seems to be a record is looked at again.
        if seen.seconds > self.tallies[seed.kind].longest {
            let before = on_processor();
            let again = attempt(seed.kind, name, read, &with).seconds;
            let busy = before.and_then(|before| on_processor()?.checked_sub(before));
            seen.seconds = busy.unwrap_or(again);
        }
        seen
    }

    fn keep(&mut self, name: &str, bytes: &[u8]) {
        self.failures += 1;
        std::fs::create_dir_all(&self.kept).expect("a folder");
        std::fs::write(self.kept.join(name), bytes).expect("it is written");
    }

    fn report(&self) {
        eprintln!(
            "kind: inputs, read, longest ms, most MiB, MiB beyond {PER_BYTE} × size, {PER_LETTER} × for texts"
        );
        let mib = |bytes: usize| bytes as f64 / f64::from(1 << 20);
        for (kind, tally) in &self.tallies {
            eprintln!(
                "{kind}: {}, {}, {:.0}, {:.1}, {:.1}",
                tally.inputs,
                tally.read,
                tally.longest.as_secs_f64() * 1e3,
                mib(tally.peak),
                mib(tally.excess)
            );
        }
    }
}

/// How long this thread has run on a processor, if the system tells.
fn on_processor() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(Duration::from_nanos(text.split(' ').next()?.parse().ok()?))
}

/// One reading.
struct Seen {
    read: bool,
    seconds: Duration,
    peak: usize,
    fault: Option<String>,
}

fn attempt(kind: &str, name: &str, bytes: &[u8], with: &With) -> Seen {
    let start = Instant::now();
    let read = || targets::read(kind, name, bytes, with);
    let (result, peak) = heap::peak_of(|| catch_unwind(AssertUnwindSafe(read)));
    let seconds = start.elapsed();
    let fault = match &result {
        Err(_) => Some("it panics".to_owned()),
        Ok(Err(text)) => {
            let clear = text.starts_with('`') && text.len() < 2000 && !text.contains(['\n', '\r']);
            (!clear).then(|| format!("no clear line: {text:.300?}"))
        }
        Ok(Ok(flaw)) => flaw.map(str::to_owned),
    };
    Seen {
        read: matches!(result, Ok(Ok(_))),
        seconds,
        peak,
        fault,
    }
}

fn setting(name: &str, usual: u64) -> u64 {
    let text = std::env::var(name).ok();
    text.map_or(usual, |text| text.parse().expect("a number"))
}

fn run(seed: u64, numbers: std::ops::Range<u64>) {
    let kept = std::env::var_os("MIMIC_FUZZ_FOLDER");
    let kept = kept.map_or_else(|| std::env::temp_dir().join("mimic-fuzz"), PathBuf::from);
    let mut run = Run::new(seed, kept);
    run.inputs(numbers);
    run.report();
    assert_eq!(run.failures, 0, "inputs that fail");
    let dull = |tally: &Tally| tally.read == 0 || tally.read == tally.inputs;
    let dull: Vec<_> = run
        .tallies
        .iter()
        .filter(|(_, tally)| dull(tally))
        .collect();
    let dull: Vec<_> = dull.iter().map(|(kind, _)| kind).collect();
    assert!(dull.is_empty(), "all or none of {dull:?} could be read");
}

#[test]
fn some_inputs() {
    run(1, 0..4000);
}

#[test]
#[ignore = "takes minutes"]
fn many_inputs() {
    let first = setting("MIMIC_FUZZ_FIRST", 0);
    let inputs = setting("MIMIC_FUZZ_INPUTS", 1_000_000);
    run(setting("MIMIC_FUZZ_SEED", 1), first..first + inputs);
}
