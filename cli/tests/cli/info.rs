//! What `mimic info` tells people.

use crate::import::with_two_takes;
use crate::workbench::Workbench;

fn text(bench: &Workbench, line: &[&str]) -> String {
    let output = bench.mimic(line).assert().success();
    String::from_utf8_lossy(&output.get_output().stdout).into_owned()
}

/// A leg that swings for 20 frames, the first of which is `apart` centimetres away.
fn leg(apart: f64) -> String {
    let head = "HIERARCHY\nROOT hips\n{\nOFFSET 0 0 0\n\
        CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n\
        JOINT leg\n{\nOFFSET 0 -40 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n\
        End Site\n{\nOFFSET 0 -50 0\n}\n}\n}\nMOTION\nFrames: 20\nFrame Time: 0.0333667\n";
    let frame = |f: u32| {
        let x = if f == 0 { apart } else { f64::from(f) };
        format!("{x} 90 0 0 0 0 0 {f} 0\n")
    };
    (0..20)
        .map(frame)
        .fold(head.to_owned(), |text, frame| text + &frame)
}

#[test]
fn the_default_take_is_marked() {
    let bench = with_two_takes();
    let shown = text(&bench, &["info", "two.gltf"]);
    let marked: Vec<&str> = shown
        .lines()
        .filter(|line| line.ends_with("default"))
        .collect();
    let takes = &bench.json(&["info", "two.gltf"])["takes"];
    assert_eq!(marked.len(), 1, "{shown}");
    let [up, down] = [&takes[0], &takes[1]];
    assert_ne!(up["default"], down["default"], "one of them");
    let name = if up["default"] == true { "up" } else { "down" };
    assert!(marked[0].contains(name), "{shown}");
    // The same take as import chooses.
    let clip = bench.json(&["import", "two.gltf"]);
    let note = clip["problems"].to_string();
    assert!(note.contains(&format!("chose take `{name}`")), "{note}");
}

#[test]
fn headings_without_lines_say_none() {
    let bench = Workbench::new();
    let still = br#"{ "asset": { "version": "2.0" }, "nodes": [{ "name": "rock", "children": [1] }, { "name": "moss" }], "skins": [{ "joints": [0, 1] }] }"#;
    bench.write("rock.gltf", still);
    let shown = text(&bench, &["info", "rock.gltf"]);
    assert!(shown.contains("\ntakes: none\n"), "{shown}");
    assert!(shown.contains("\njoint map: none\n"), "{shown}");
    let bench = Workbench::with_clip();
    let shown = text(&bench, &["info", "sway.txt"]);
    assert!(
        !shown.contains("takes: none") && !shown.contains("joint map: none"),
        "{shown}"
    );
    let problems = bench.json(&["info", "sway.txt"])["problems"]
        .as_array()
        .map(Vec::len);
    assert_eq!(
        shown.contains("\nproblems: none\n"),
        problems == Some(0),
        "{shown}"
    );
}

#[test]
fn it_says_why_a_frame_is_left_out() {
    let bench = Workbench::new();
    for (apart, left_out) in [(-80.0, true), (0.0, false)] {
        bench.write("leg.bvh", leg(apart).as_bytes());
        let shown = text(&bench, &["info", "leg.bvh"]);
        assert_eq!(shown.contains("first-frame-left-out"), left_out, "{shown}");
        let frames = bench.json(&["import", "leg.bvh"])["frames"].as_u64();
        assert_eq!(frames, Some(20 - u64::from(left_out)));
    }
}

#[test]
fn numbers_have_no_more_digits_than_anybody_needs() {
    let bench = Workbench::new();
    bench.write("leg.bvh", leg(0.0).as_bytes());
    let shown = text(&bench, &["info", "leg.bvh"]);
    let words = shown.split(|c: char| !(c.is_ascii_digit() || c == '.'));
    let digits = |word: &str| word.trim_start_matches(['0', '.']).replace('.', "").len();
    let long: Vec<&str> = words.filter(|word| digits(word) > 4).collect();
    assert!(long.is_empty(), "{long:?} in {shown}");
    assert!(shown.contains("29.97 Hz"), "{shown}");
}
