//! Every command of the README works, in the order in which it stands there.

use crate::workbench::Workbench;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Lines of the README's shell blocks, without their comments.
fn commands() -> Vec<String> {
    let text = std::fs::read_to_string(root().join("README.md")).expect("the README is there");
    let blocks = text.split("```sh\n").skip(1);
    let lines = blocks.flat_map(|block| block.split("```").next().unwrap_or("").lines());
    lines
        .map(|line| line.split('#').next().unwrap_or("").trim().to_owned())
        .filter(|line| !line.is_empty())
        .collect()
}

/// The arguments of a command that runs `mimic`; `None` for the builds around it.
fn arguments(command: &str) -> Option<Vec<&str>> {
    let rest = command
        .strip_prefix("cargo run --release -- ")
        .or_else(|| command.strip_prefix("mimic "));
    if rest.is_none() {
        let builds = [
            "cargo test --release --workspace",
            "cargo install --locked --path cli",
        ];
        assert!(
            builds.contains(&command),
            "neither mimic nor a known build: `{command}`"
        );
    }
    rest.map(|rest| rest.split_whitespace().collect())
}

#[test]
fn every_command_of_the_readme_works() {
    let bench = Workbench::new();
    let kick = std::fs::read(root().join("clips/kick.fbx")).expect("our own kick is there");
    std::fs::create_dir(bench.path("clips")).expect("a folder can be made");
    bench.write("clips/kick.fbx", &kick);
    bench.write("kick.fbx", &kick);
    let commands = commands();
    let lines: Vec<_> = commands
        .iter()
        .filter_map(|command| arguments(command))
        .collect();
    assert!(
        lines
            .iter()
            .any(|line| line == &["train", "clips/kick.fbx"]),
        "the first command"
    );
    for mut line in lines {
        if line[0] == "train" {
            // One iteration shows that it works; that it learns is recorded in docs/results.md.
            line.extend(["--samples", "4096"]);
        }
        bench.mimic(&line).assert().success();
    }
    for made in [
        "runs/kick/policy.safetensors",
        "runs/kick/eval.json",
        "runs/kick/replay.rrd",
    ] {
        assert!(bench.path(made).exists(), "{made}");
    }
    for made in [
        "kick.clip",
        "kick.motion",
        "kick.svg",
        "kick-tracks.svg",
        "kick.rrd",
        "reference.rrd",
    ] {
        assert!(bench.path(made).exists(), "{made}");
    }
}
