//! Completions, as a shell asks for them.

use crate::workbench::Workbench;
use std::path::Path;
use std::process::Command;

/// What bash offers for the last of these words; `None` where there is no bash.
fn offered(bench: &Workbench, words: &[&str]) -> Option<Vec<String>> {
    let program = assert_cmd::cargo::cargo_bin("mimic");
    let folder = program.parent().unwrap_or(Path::new("/"));
    // The function that the script registers is called as bash would call it.
    let ask = r#"
        PATH="$1:$PATH"; shift
        source <(mimic completions bash)
        function=$(complete -p mimic | sed -E 's/.*-F ([^ ]+).*/\1/')
        COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMP_TYPE=9
        "$function" mimic "${COMP_WORDS[COMP_CWORD]}"
        printf '%s\n' "${COMPREPLY[@]}"
    "#;
    let output = Command::new("bash")
        .args(["--norc", "-c", ask, "bash"])
        .arg(folder)
        .args(words)
        .current_dir(bench.path("."))
        .env_remove("MIMIC_LIBRARY")
        .output()
        .ok()?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && said.is_empty(), "{said}");
    Some(text.lines().map(|line| line.trim().to_owned()).collect())
}

#[test]
fn bash_is_offered_what_is_there() {
    let bench = Workbench::with_run();
    std::fs::create_dir(bench.path("clips")).expect("a folder can be made");
    std::fs::copy(bench.path("sway.txt"), bench.path("clips/lean.txt")).expect("copied");
    bench.write("notes.md", b"train more");
    for (words, word) in [
        (&["mimic", "ev"][..], "eval"),
        (&["mimic", "eval", ""], "sway"),
        (&["mimic", "train", "--resume", "s"], "sway"),
        (&["mimic", "replay", ""], "sway"),
        (&["mimic", "train", "l"], "lean"),
        (&["mimic", "train", "sw"], "sway.txt"),
        (
            &["mimic", "train", "sway.txt", "--preset", "boo"],
            "booth2020",
        ),
        (
            &["mimic", "train", "sway.txt", "--preset", "t"],
            "tiny.json",
        ),
        (
            &["mimic", "retarget", "sway.txt", "--skeleton", "mar"],
            "marathon",
        ),
        (&["mimic", "import", "sway.txt", "--take", ""], "sway"),
        (&["mimic", "train", "lean", "--take", ""], "lean"),
        (&["mimic", "train", "lean", "--set", "ppo.ga"], "ppo.gamma="),
        (&["mimic", "retarget", "lean", "--weight", "hea"], "head="),
        (&["mimic", "train", "lean", "--sam"], "--samples"),
    ] {
        let Some(offered) = offered(&bench, words) else {
            mimic_test_support::skip("no `bash` to ask for completions");
            return;
        };
        assert!(
            offered.iter().any(|offer| offer == word),
            "{words:?}: {offered:?}"
        );
    }
    let clips = offered(&bench, &["mimic", "import", ""]).unwrap_or_default();
    assert!(
        !clips.contains(&"notes.md".to_owned()),
        "no clip: {clips:?}"
    );
}
