//! ASF and AMC files compared with a direct evaluation of Acclaim's formula in plain matrices, and with a BVH file that others
//! made from the same take.

use super::acclaim_reference::{asf, places};
use super::bvh::{Place, agrees, evaluate};
use super::damage::Damage;
use mimic::explain::Explain;
use mimic::humanoid::{self, Slot};
use mimic::import::{self, Options};
use mimic_test_support::foreign;
use std::collections::BTreeMap;
use std::path::Path;

/// Metres per unit of the CMU database.
const CMU: f64 = 0.0254 / 0.45;

fn checked(skeleton: &str, motion: &str, clip: &mimic::clip::Clip, unit: f64, what: &str) {
    let of_joints = |places: BTreeMap<String, Place>| -> Vec<Place> {
        let joints = clip.joints.iter();
        joints.map(|joint| places[&joint.name]).collect()
    };
    let expected = places(&asf(skeleton), motion);
    let expected: Vec<Vec<Place>> = expected.into_iter().map(of_joints).collect();
    agrees(clip, &expected, 'y', unit, what);
}

fn text(path: &Path) -> String {
    std::fs::read_to_string(path).expect("the file opens")
}

#[test]
fn every_joint_of_every_frame_follows_the_formula() {
    let (Some(amc), Some(skeleton)) = (foreign("cmu/01_01.amc"), foreign("cmu/01.asf")) else {
        return;
    };
    let clip = import::load(&amc, &Options::default()).expect("it imports");
    assert_eq!((clip.frames.len(), clip.fps), (2751, 120.0));
    assert_eq!(clip.source.format, "amc");
    assert!((clip.source.unit_m - CMU).abs() < 1e-15);
    let ids: Vec<&str> = clip.problems.iter().map(|p| p.id.as_str()).collect();
    assert_eq!(ids, ["rate-assumed"]);
    checked(&text(&skeleton), &text(&amc), &clip, CMU, "01_01.amc");
}

/// The BVH of this take begins one frame earlier, in the rest pose. It also leaves out the lengths of the bones that branch, the
/// thorax and the wrists: their children begin where they begin. All other positions agree.
#[test]
fn the_same_take_as_bvh_has_the_same_places() {
    let (Some(amc), Some(skeleton), Some(bvh)) = (
        foreign("cmu/01_01.amc"),
        foreign("cmu/01.asf"),
        foreign("cmu/01_01.bvh"),
    ) else {
        return;
    };
    let mut shortened = String::new();
    let mut branches = false;
    for line in text(&skeleton).lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["name", name] => branches = ["thorax", "lwrist", "rwrist"].contains(&name),
            ["length", _] if branches => {
                shortened += "length 0\n";
                continue;
            }
            _ => {}
        }
        shortened += line;
        shortened += "\n";
    }
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("01.asf"), shortened).expect("it is written");
    let bytes = std::fs::read(&amc).expect("the file opens");
    let read = import::read(
        &bytes,
        "01_01.amc",
        Some(folder.path()),
        &Options::default(),
    );
    let clip = read.expect("it imports");
    let theirs = evaluate(&text(&bvh));
    let bvh = import::load(&bvh, &Options::default()).expect("it imports");
    assert_eq!(theirs.len(), clip.frames.len() + 1);
    let names = bvh.joints.iter().map(|joint| acclaim_name(&joint.name));
    let ours: Vec<usize> = names
        .map(|name| clip.joints.iter().position(|joint| joint.name == name))
        .map(|joint| joint.expect("the same joints"))
        .collect();
    assert_eq!(ours.len(), clip.joints.len());
    let mut worst = 0.0f64;
    for (frame, theirs) in theirs[1..].iter().enumerate() {
        let world = clip.world(frame);
        for (&joint, &[x, y, z]) in ours.iter().zip(theirs) {
            let theirs = nalgebra::Vector3::new(z, x, y) * CMU;
            worst = worst.max((world[joint].translation.vector - theirs).norm());
        }
    }
    eprintln!("farthest joint: {} mm", worst * 1e3);
    assert!(worst < 1e-4, "{worst} m");
}

/// The ASF's names of the BVH's joints.
fn acclaim_name(bvh: &str) -> String {
    let (bvh, end) = match bvh.strip_suffix("_end") {
        Some(bvh) => (bvh, "_end"),
        None => (bvh, ""),
    };
    let side = match bvh.chars().next() {
        Some('L') if bvh != "LowerBack" => "l",
        Some('R') => "r",
        _ => "",
    };
    let sideless = bvh.trim_start_matches("Left").trim_start_matches("Right");
    let name = match sideless {
        "Hips" => "root",
        "LHipJoint" | "RHipJoint" => "hipjoint",
        "UpLeg" => "femur",
        "Leg" => "tibia",
        "Foot" => "foot",
        "ToeBase" => "toes",
        "LowerBack" => "lowerback",
        "Spine" => "upperback",
        "Spine1" => "thorax",
        "Neck" => "lowerneck",
        "Neck1" => "upperneck",
        "Head" => "head",
        "Shoulder" => "clavicle",
        "Arm" => "humerus",
        "ForeArm" => "radius",
        "Hand" => "wrist",
        "FingerBase" => "hand",
        "LFingers" | "RFingers" | "LeftHandIndex1" | "RightHandIndex1" | "HandIndex1" => "fingers",
        "LThumb" | "RThumb" => "thumb",
        other => panic!("{other}"),
    };
    format!("{side}{name}{end}")
}

#[test]
fn the_skeleton_alone_has_joints_and_no_motion() {
    let Some(path) = foreign("cmu/01.asf") else {
        return;
    };
    let look = import::inspect(&path).expect("it opens");
    assert_eq!((look.format.as_str(), look.takes.len()), ("asf", 0));
    // The root, 30 bones, and the ends of the seven that have none behind them.
    let ends = look.joints.iter().filter(|j| j.name.ends_with("_end"));
    assert_eq!((look.joints.len(), ends.count()), (38, 7));
    let map = humanoid::map(&look.joints).expect("a humanoid");
    let joint = |slot| {
        map.joint(slot)
            .map(|joint| look.joints[joint].name.as_str())
    };
    for (slot, name) in [
        (Slot::Hips, "root"),
        (Slot::Spine, "lowerback"),
        (Slot::Chest, "thorax"),
        (Slot::Neck, "lowerneck"),
        (Slot::Head, "head"),
        (Slot::LeftShoulder, "lclavicle"),
        (Slot::LeftUpperArm, "lhumerus"),
        (Slot::LeftLowerArm, "lradius"),
        (Slot::LeftHand, "lwrist"),
        (Slot::RightShoulder, "rclavicle"),
        (Slot::RightUpperArm, "rhumerus"),
        (Slot::RightLowerArm, "rradius"),
        (Slot::RightHand, "rwrist"),
        (Slot::LeftUpperLeg, "lfemur"),
        (Slot::LeftLowerLeg, "ltibia"),
        (Slot::LeftFoot, "lfoot"),
        (Slot::LeftToes, "ltoes"),
        (Slot::RightUpperLeg, "rfemur"),
        (Slot::RightLowerLeg, "rtibia"),
        (Slot::RightFoot, "rfoot"),
        (Slot::RightToes, "rtoes"),
    ] {
        assert_eq!(joint(slot), Some(name), "{slot:?}");
    }
    let refused = import::load(&path, &Options::default()).expect_err("refused");
    let said = refused.to_string();
    assert!(
        said.ends_with("01.asf`: the file is a skeleton without motion; give one of the .amc files that belong to it"),
        "{said}"
    );
}

/// A skeleton with everything that few programs write: radians, unusual orders of axes, a root away from the origin, a bone that
/// slides, one without degrees of freedom, and one that comes before its parent.
const SKELETON: &str = "# made\r\n:version 1.10\n:name made\n:units\n  mass 1.0\n  length 0.9\n  angle rad\n:root\n  order RZ RX RY TX TY TZ\n  axis ZYX\n  position 1 2 3\n  orientation 0.1 0.2 0.3\n:bonedata\n\
    begin\n id 2\n name arm\n direction 0.6 0.8 0\n length 20\n axis 0.3 -0.4 0.5 YZX\n dof tx ry rx tz\n limits (-inf inf)\n (-1 1)\n (-2 2)\n (0 1)\n end\n\
    begin\n id 1\n name trunk\n direction 0 1 0\n length 30\n axis 0 1.1 0 XYZ\n dof rx\n end\n\
    begin\n id 3\n name stiff\n direction 0 0 1\n length 5\n axis 0 0 0 XYZ\n end\n\
    :hierarchy\n begin\n root trunk\n trunk arm stiff\n end\n:skin none\n";
const MOTION: &str = "#!OML:ASF made.asf\n:FULLY-SPECIFIED\n:RADIANS\n:SAMPLES-PER-SECOND 60\n\
    1\nroot 0.1 0.2 0.3 4 5 6\ntrunk 0.5\narm 0.25 0.75 -0.5 0.125\n\
    2\nroot -1.1 2.2 0.4 7 5 6\narm 1.25 0.5 2.5 0\ntrunk 1.5\n\
    3\ntrunk 0\narm 0 0 0 0\nroot 0 0 0 0 0 0\n";

/// Reads a motion with a skeleton beside it.
fn read(skeleton: &str, motion: &str) -> Result<mimic::clip::Clip, String> {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("a.asf"), skeleton).expect("it is written");
    let motion = motion.as_bytes();
    let read = import::read(motion, "a.amc", Some(folder.path()), &Options::default());
    read.map_err(|error| error.to_string())
}

#[test]
fn every_order_unit_and_freedom_follows_the_formula() {
    let clip = read(SKELETON, MOTION).expect("it imports");
    assert_eq!((clip.frames.len(), clip.fps), (3, 60.0));
    let names: Vec<&str> = clip.joints.iter().map(|j| j.name.as_str()).collect();
    assert_eq!(
        names,
        ["root", "trunk", "arm", "arm_end", "stiff", "stiff_end"]
    );
    // 30 + 16 units of an inch / 0.9 are 1.30 m: the stated unit is believed.
    checked(SKELETON, MOTION, &clip, 0.0254 / 0.9, "made");
}

/// The number of the line in which `mark` stands.
fn line_of(text: &str, mark: &str) -> usize {
    let at = text.find(mark).expect(mark);
    text[..at].matches('\n').count() + 1
}

#[test]
fn broken_files_are_refused_by_line() {
    for (from, to, line, says) in [
        (
            "3\ntrunk",
            "3\ntail",
            "tail",
            "`tail` isn't in its skeleton",
        ),
        ("-1.1 2.2 0.4 7 5 6", "-1.1", "-1.1", "degrees of freedom"),
        ("arm 1.25", "arm 1.25 0.5", "1.25", "degrees of freedom"),
        ("2.2 0.4", "2.2 nan", "nan", "`nan`"),
        (
            "trunk 1.5\n3",
            "3",
            "3\ntrunk",
            "2 of the first one's 3 bones",
        ),
        ("trunk 1.5\n", "arm 1 1 1 1\n", "arm 1 1", "twice"),
        ("SECOND 60", "SECOND 0", ":SAMPLES", "`0`"),
        ("1\nroot", "root", "root", "number of a frame"),
    ] {
        let text = MOTION.replacen(from, to, 1);
        assert_ne!(text, MOTION, "{from}");
        let line = line_of(&text, line);
        let said = read(SKELETON, &text).expect_err(to);
        assert!(
            said.starts_with(&format!("`a.amc`: line {line}: ")),
            "{said}"
        );
        assert!(said.contains(says), "{said}");
    }
    for (from, to, line, says) in [
        ("length 20", "length long", "long", "`long`"),
        ("YZX", "YYX", "YYX", "`YYX`"),
        ("dof rx\n", "dof rw\n", "dof rw", "`rw`"),
        (
            "trunk arm stiff",
            "trunk arm",
            "begin\n id 3",
            "`stiff` has no parent",
        ),
        (
            "arm stiff",
            "arm stiff arm",
            "arm stiff arm",
            "`arm` is in the hierarchy twice",
        ),
        (
            "root trunk",
            "stiff trunk",
            "begin\n id 2",
            "`arm` has no parent",
        ),
        (
            "name stiff",
            "name arm",
            "begin\n id 3",
            "second bone is called `arm`",
        ),
    ] {
        let text = SKELETON.replacen(from, to, 1);
        assert_ne!(text, SKELETON, "{from}");
        let said = read(&text, MOTION).expect_err(to);
        let place = format!("/a.asf`: line {}: ", line_of(&text, line));
        assert!(said.contains(&place) && said.contains(says), "{said}");
    }
}

#[test]
fn cut_files_are_refused_or_read_in_part() {
    for end in 0..MOTION.len() {
        if let Ok(clip) = read(SKELETON, &MOTION[..end]) {
            assert!(clip.frames.len() <= 3);
        }
    }
    let last = MOTION.rfind("arm 0 0").expect("a line");
    for end in [last, last + 2, last + 7] {
        let clip = read(SKELETON, &MOTION[..end]).expect("the frames before the cut");
        assert_eq!(clip.frames.len(), 2);
        assert!(clip.problems.iter().any(|p| p.id == "frame-cut"));
    }
    for end in 0..SKELETON.len() {
        let _ = read(&SKELETON[..end], MOTION);
    }
}

#[test]
fn skeletons_are_found_beside_their_motion() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, trunk: &str| {
        let text = SKELETON.replace("trunk", trunk);
        std::fs::write(folder.path().join(name), text).expect("it is written");
    };
    let motion = |trunk: &str| MOTION.replace("trunk", trunk);
    let read = |name: &str, trunk: &str, folder: Option<&Path>| {
        let motion = motion(trunk);
        let read = import::read(motion.as_bytes(), name, folder, &Options::default());
        read.map(|clip| clip.joints.len())
            .map_err(|e| e.to_string())
    };
    let here = Some(folder.path());
    let said = read("07_01.amc", "trunk", None).expect_err("refused");
    assert!(
        said.starts_with("`07_01.amc`: ") && said.contains("07.asf"),
        "{said}"
    );
    let said = read("07_01.amc", "trunk", here).expect_err("refused");
    assert!(said.contains("no .asf is beside it"), "{said}");
    write("z.ASF", "sole");
    assert_eq!(read("07_01.amc", "sole", here), Ok(6));
    write("07.asf", "subject");
    assert_eq!(read("07_01.amc", "subject", here), Ok(6));
    write("07_01.asf", "own");
    assert_eq!(read("07_01.amc", "own", here), Ok(6));
    assert_eq!(read("07_02.amc", "subject", here), Ok(6));
    let said = read("08_01.amc", "sole", here).expect_err("refused");
    assert!(
        said.contains("none of the 3") && said.contains("08.asf"),
        "{said}"
    );
}

#[test]
fn damaged_files_are_refused_or_read_whole() {
    let mut damage = Damage::new();
    let mut refused = 0;
    for round in 0..4000 {
        let (mut skeleton, mut motion) = (SKELETON.as_bytes().to_vec(), MOTION.as_bytes().to_vec());
        let damaged = if round % 2 == 0 {
            &mut skeleton
        } else {
            &mut motion
        };
        damage.apply(damaged, 2000);
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("a.asf"), skeleton).expect("it is written");
        match import::read(&motion, "a.amc", Some(folder.path()), &Options::default()) {
            Ok(clip) => {
                let mut locals = clip.frames.iter().flatten();
                assert!(locals.all(|t| t.to_homogeneous().iter().all(|x| x.is_finite())));
            }
            Err(error) => {
                refused += 1;
                let said = error.to_string();
                assert!(
                    (said.starts_with("`a.amc`: ") || said.contains("/a.asf`: "))
                        && said.lines().count() == 1,
                    "{said}"
                );
            }
        }
    }
    assert!(refused > 0);
}

/// A skeleton without a bone is named, not the motion that it lies beside.
#[test]
fn a_broken_skeleton_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let motion = folder.path().join("a.amc");
    std::fs::write(&motion, ":FULLY-SPECIFIED\n:DEGREES\n1\nroot 0 0 0 0 0 0\n").expect("written");
    let beside = folder.path().join("b.asf");
    for text in ["", "# nothing\n", ":root\n", ":bonedata\nbegin\n", "\u{0}"] {
        std::fs::write(&beside, text).expect("written");
        let told = import::load(&motion, &Options::default())
            .expect_err("refused")
            .explain();
        assert_eq!(told.file.as_ref(), Some(&beside), "{text:?}: {told}");
    }
    let Some(case) = foreign("../cases/solid/amc-beside-empty-asf/A_empty_asf.amc") else {
        return;
    };
    let told = import::load(&case, &Options::default())
        .expect_err("refused")
        .explain();
    assert_eq!(told.file, Some(case.with_file_name("s.asf")), "{told}");
}
