//! Writes `docs/results.md` from the measured runs in `results/*.jsonl` and the text in `results/page.md`.
//!
//! ```sh
//! cargo run --release --example results              # writes the page
//! cargo run --release --example results -- --check   # says whether the page is up to date
//! ```
//!
//! Every line of a `.jsonl` file is one run, or several that differ in their seed alone. Its `figures` are what was
//! measured and `asked` what was wanted; a figure is a number, a list with one number for each seed or start, or
//! `{"min": …, "max": …}` over the seeds. A line `{{skills}}` in the page's text is where the table of `skills.jsonl` goes.

use serde_json::{Map, Value};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

type Line = Map<String, Value>;

/// A table of the page: `rows` says which runs share a row, `columns` what is said about them. Both are pairs of a heading
/// and a key: one of the line, of its `figures`, or, after `asked.`, of what was asked. `a|b` takes `b` where there is no
/// `a`, and `a unit` writes a unit behind each value.
struct Table {
    file: &'static str,
    rows: &'static [(&'static str, &'static str)],
    columns: &'static [(&'static str, &'static str)],
}

/// Runs of one skill with as many samples on one processor share a row.
const SKILLS: &[(&str, &str)] = &[
    ("skill", "skill"),
    ("samples", "samples"),
    ("processor", "cpu"),
];

const TABLES: &[Table] = &[
    Table {
        file: "skills",
        rows: SKILLS,
        columns: &[
            ("survival asked", "asked.survival"),
            ("survival", "survival"),
            ("local error asked, mm", "asked.mpjpe_local_mm"),
            ("local error, mm", "mpjpe_local_mm"),
            ("time asked", "asked.minutes min"),
            ("time", "minutes min|seconds s"),
            ("normalised return", "normalized_return"),
        ],
    },
    Table {
        file: "skills-more",
        rows: &[("skill", "skill"), ("processor", "cpu")],
        columns: &[
            ("survival from the first frame", "survival_from_first_frame"),
            ("global error, mm", "mpjpe_global_mm"),
            ("contact F1", "contact_f1"),
            ("never 0.25 m off", "success_max_0_25"),
            ("turned in 20 s, rad", "root_rotation_turned_rad"),
            (
                "the reference turned, rad",
                "root_rotation_of_reference_rad",
            ),
        ],
    },
    Table {
        file: "whole-body",
        rows: SKILLS,
        columns: &[
            ("survival asked", "asked.survival"),
            ("survival", "survival"),
            ("from the first frame", "survival_from_first_frame"),
            ("from starts within reach", "survival_within_reach"),
            ("local error asked, mm", "asked.mpjpe_local_mm"),
            ("local error, mm", "mpjpe_local_mm"),
            ("normalised return", "normalized_return"),
        ],
    },
    Table {
        file: "several-clips",
        rows: &[("clip", "clip")],
        columns: &[
            ("survival asked", "asked.survival"),
            ("survival", "survival"),
            ("local error, mm", "mpjpe_local_mm"),
            ("normalised return", "normalized_return"),
            (
                "survival, trained with transitions",
                "survival_trained_with_transitions",
            ),
            (
                "local error, mm, trained with transitions",
                "mpjpe_local_mm_trained_with_transitions",
            ),
        ],
    },
    Table {
        file: "deepmimic",
        rows: &[("clip", "clip")],
        columns: &[
            ("the original's return", "asked.normalized_return"),
            ("the original's samples", "asked.samples_of_original"),
            ("normalised return", "normalized_return"),
            ("samples", "samples"),
            ("survival", "survival"),
            ("local error, mm", "mpjpe_local_mm"),
        ],
    },
    Table {
        file: "disturbed",
        rows: &[
            ("clip", "clip"),
            ("samples", "samples"),
            ("processor", "cpu"),
        ],
        columns: &[
            ("survival, undisturbed", "survival"),
            ("local error, mm", "mpjpe_local_mm"),
            ("survival under shoves", "survival_disturbed"),
            ("local error, mm", "mpjpe_local_mm_disturbed"),
        ],
    },
    Table {
        file: "in-mujoco",
        rows: &[
            ("skill", "skill"),
            ("starts", "start"),
            ("trained on", "cpu"),
        ],
        columns: &[
            ("asked", "asked.seconds s"),
            ("lasts", "seconds s"),
            ("local error, mm", "mpjpe_local_mm"),
        ],
    },
    Table {
        file: "characters",
        rows: &[
            ("character", "character"),
            ("clip", "clip"),
            ("samples", "samples"),
        ],
        columns: &[
            ("survival", "survival"),
            ("local error, mm", "mpjpe_local_mm"),
            ("normalised return", "normalized_return"),
            ("time", "minutes min"),
        ],
    },
    Table {
        file: "bench",
        rows: &[("what", "engine"), ("processor", "cpu")],
        columns: &[
            ("physics steps/s", "physics_steps_per_second"),
            ("environment steps/s", "env_steps_per_second"),
            ("training samples/s asked", "asked.train_samples_per_second"),
            ("training samples/s", "train_samples_per_second"),
            ("whole run", "seconds s"),
        ],
    },
    Table {
        file: "physics-speed",
        rows: &[("the character", "motion")],
        columns: &[
            ("ours, eight at once", "eight_at_once"),
            ("ours, one alone", "one_alone"),
            ("rapier", "rapier"),
            ("MuJoCo 4.0", "mujoco"),
        ],
    },
    Table {
        file: "preparation",
        rows: &[("program", "program")],
        columns: &[
            (
                "retargeting asked, frames/s",
                "asked.retarget_frames_per_second",
            ),
            ("retargeting, frames/s", "retarget_frames_per_second"),
            ("import of eight files", "import_ms ms"),
            ("beside ufbx reading them", "import_vs_ufbx_reading"),
        ],
    },
    Table {
        file: "first-build",
        rows: &[("program", "program"), ("processor", "cpu")],
        columns: &[
            ("clock asked", "asked.minutes min"),
            ("clock", "minutes min"),
            ("CPU time", "cpu_minutes min"),
            ("recording asked", "asked.recording_s s"),
            ("recording", "recording_s s"),
            ("training samples/s", "train_samples_per_second"),
        ],
    },
    Table {
        file: "exactness",
        rows: &[("what", "what"), ("against", "against")],
        columns: &[
            ("deviation allowed", "asked.worst"),
            ("worst deviation", "worst"),
            ("where it is checked", "checked"),
        ],
    },
    Table {
        file: "retargeting",
        rows: &[("character", "character"), ("clips", "clips")],
        columns: &[
            ("key points asked", "asked.keypoint_error_median_cm cm"),
            ("key points, median", "keypoint_error_median_cm cm"),
            ("feet asked", "asked.foot_speed_cm_s cm/s"),
            ("feet that should stand, mean", "foot_speed_cm_s cm/s"),
            ("depth asked", "asked.depth_cm cm"),
            ("deepest point", "depth_cm cm"),
            ("highest in contact", "float_in_contact_cm cm"),
            ("coordinates out of range", "outside_range"),
        ],
    },
    Table {
        file: "retargeting-clips",
        rows: &[("clip", "clip")],
        columns: &[
            ("key points, median", "keypoint_error_median_cm cm"),
            ("99 %", "keypoint_error_99_percent_cm cm"),
            ("feet that should stand", "foot_speed_cm_s cm/s"),
            (
                "longest step beyond the source's",
                "longest_step_beyond_source_cm cm",
            ),
        ],
    },
    Table {
        file: "damaged-files",
        rows: &[("files", "files"), ("processor", "cpu"), ("seed", "seed")],
        columns: &[
            ("copies", "copies"),
            ("read", "read"),
            ("time asked", "asked.longest_ms ms"),
            ("longest", "longest_ms ms"),
            ("most memory, MiB", "most_memory_mib"),
            ("memory asked, MiB", "asked.beyond_64_times_size_mib"),
            ("beyond 64 times the size, MiB", "beyond_64_times_size_mib"),
            (
                "memory asked of a text, MiB",
                "asked.beyond_16_times_size_mib",
            ),
            ("beyond 16 times its size, MiB", "beyond_16_times_size_mib"),
        ],
    },
    Table {
        file: "same-bits",
        rows: &[
            ("samples", "samples"),
            ("processor", "cpu"),
            ("program", "commit"),
        ],
        columns: &[
            ("SHA-256 of the policy begins", "policy_sha256_begins"),
            ("threads", "threads"),
            ("kills", "kills"),
        ],
    },
];

fn main() -> ExitCode {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = page(&root.join("results"));
    let file = root.join("docs/results.md");
    let is_check = std::env::args().any(|argument| argument == "--check");
    if is_check && fs::read_to_string(&file).unwrap_or_default() != page {
        eprintln!("docs/results.md is out of date; run `cargo run --release --example results`");
        return ExitCode::FAILURE;
    }
    if !is_check {
        fs::write(&file, page).expect("docs/results.md can be written");
    }
    ExitCode::SUCCESS
}

fn page(folder: &Path) -> String {
    let text = fs::read_to_string(folder.join("page.md")).expect("results/page.md is there");
    let place = |line: &str| match line.strip_prefix("{{").and_then(|l| l.strip_suffix("}}")) {
        Some(name) => table(folder, name),
        None => format!("{line}\n"),
    };
    text.lines().map(place).collect()
}

fn table(folder: &Path, name: &str) -> String {
    let table = TABLES.iter().find(|table| table.file == name);
    let table =
        table.unwrap_or_else(|| panic!("results/page.md has a table that is unknown: {name}"));
    // One file can give several tables: `skills-more` is of `skills`.
    let lines = lines(&folder.join(format!("{}.jsonl", name.trim_end_matches("-more"))));
    let headings = table
        .rows
        .iter()
        .chain(table.columns)
        .map(|(heading, _)| heading);
    let mut text = format!(
        "| {} |\n",
        headings.copied().collect::<Vec<_>>().join(" | ")
    );
    text += &format!(
        "|{}\n",
        "---|".repeat(table.rows.len() + table.columns.len())
    );
    for group in groups(table, &lines) {
        let rows = table.rows.iter().map(|(_, key)| cell(&group[..1], key));
        let columns: Vec<String> = table
            .columns
            .iter()
            .map(|(_, key)| cell(&group, key))
            .collect();
        // Runs that measured something else have no part in this table.
        if columns.iter().any(|column| !column.is_empty()) {
            let cells: Vec<String> = rows.chain(columns).collect();
            text += &format!("| {} |\n", cells.join(" | "));
        }
    }
    text
}

fn lines(file: &PathBuf) -> Vec<Line> {
    let text = fs::read_to_string(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let read = |(i, line)| {
        serde_json::from_str(line).unwrap_or_else(|e| panic!("{}:{}: {e}", file.display(), i + 1))
    };
    text.lines().enumerate().map(read).collect()
}

/// The lines that share a row, in the order of the file.
fn groups<'a>(table: &Table, lines: &'a [Line]) -> Vec<Vec<&'a Line>> {
    let mut groups: Vec<Vec<&Line>> = Vec::new();
    for line in lines {
        let is_same = |group: &Vec<&Line>| {
            table
                .rows
                .iter()
                .all(|(_, key)| value(group[0], key) == value(line, key))
        };
        match groups.iter_mut().find(|group| is_same(group)) {
            Some(group) => group.push(line),
            None => groups.push(vec![line]),
        }
    }
    groups
}

/// What the lines say under a key: one value where all agree, else all in turn.
fn cell(lines: &[&Line], keys: &str) -> String {
    for key in keys.split('|') {
        let (key, unit) = key.split_once(' ').unwrap_or((key, ""));
        let values: Vec<&Value> = lines.iter().filter_map(|line| value(line, key)).collect();
        // Numbers of one cell have the same number of decimals: "1.00, 0.97".
        let decimals = values.iter().map(|value| decimals(value)).max();
        let shown = values
            .iter()
            .map(|value| words(value, unit, decimals.unwrap_or(0)));
        let mut shown: Vec<String> = shown.collect();
        if shown.windows(2).all(|pair| pair[0] == pair[1]) {
            shown.truncate(1);
        }
        if !shown.is_empty() {
            return shown.join(", ").replace('|', "\\|");
        }
    }
    String::new()
}

fn decimals(value: &Value) -> usize {
    match value {
        Value::Array(list) => list.iter().map(decimals).max().unwrap_or(0),
        Value::Object(range) => range.values().map(decimals).max().unwrap_or(0),
        Value::Number(number) => number
            .to_string()
            .split_once('.')
            .map_or(0, |(_, d)| d.len()),
        _ => 0,
    }
}

fn value<'a>(line: &'a Line, key: &str) -> Option<&'a Value> {
    match key.strip_prefix("asked.") {
        Some(key) => line.get("asked").and_then(|asked| asked.get(key)),
        None => line.get(key).or_else(|| line["figures"].get(key)),
    }
}

fn words(value: &Value, unit: &str, decimals: usize) -> String {
    let unit = match unit {
        "" => String::new(),
        unit => format!(" {unit}"),
    };
    match value {
        Value::Array(list) => {
            let list: Vec<String> = list.iter().map(|v| words(v, "", decimals)).collect();
            list.join(", ") + &unit
        }
        Value::Object(range) => {
            let [min, max] = ["min", "max"].map(|end| words(&range[end], "", decimals));
            format!("{min} to {max}{unit}")
        }
        Value::Number(number) if number.is_f64() => {
            format!("{:.decimals$}{unit}", number.as_f64().unwrap_or(f64::NAN))
        }
        Value::Number(number) => thousands(&number.to_string()) + &unit,
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

/// A whole number with commas; what has a point or an exponent stays.
fn thousands(digits: &str) -> String {
    if digits.len() < 5 || !digits.bytes().all(|digit| digit.is_ascii_digit()) {
        return digits.to_owned();
    }
    let first = (digits.len() + 2) % 3 + 1;
    let rest = digits.as_bytes()[first..].chunks(3);
    let rest = rest.map(|three| format!(",{}", String::from_utf8_lossy(three)));
    digits[..first].to_owned() + &rest.collect::<String>()
}
