//! Characters that contradict themselves or physics are refused, with the place and what to do.

use mimic::explain::{Explain, Fault};
use mimic::import;
use mimic::motion::Motion;
use mimic::retarget::{self, retarget};
use mimic::skeleton::Skeleton;
use mimic_test_support::foreign;
use std::fmt::Write;
use std::time::{Duration, Instant};

/// A torso on a free joint with one arm. Every number that a test may spoil stands in it once.
const ARM: &str = r#"<mujoco>
  <compiler angle="radian" boundmass="0"/>
  <option timestep="0.005" gravity="0 0 -9.81"/>
  <worldbody>
    <body name="torso" pos="0 0 1" quat="1 0 0 0">
      <freejoint/>
      <geom name="trunk" type="sphere" size="0.2" mass="20" friction="0.9 0.005 0.0001"/>
      <body name="arm" pos="0 0.3 0">
        <joint name="elbow" axis="0 1 0" range="-2 0.5" damping="1" stiffness="0" armature="0.01" frictionloss="0"/>
        <inertial pos="0 0.1 0" mass="2" diaginertia="0.02 0.01 0.02"/>
        <geom name="bone" type="capsule" fromto="0 0 0 0 0.25 0" size="0.04" density="900"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="servo" joint="elbow" gear="1" kp="100" kv="10" forcerange="-50 50" ctrlrange="-2 0.5"/>
  </actuator>
</mujoco>"#;

/// Loads a character from a file.
fn load(xml: &str) -> Result<Skeleton, mimic::skeleton::SkeletonError> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("arm.xml");
    std::fs::write(&path, xml).expect("it is written");
    Skeleton::load(path)
}

/// What is said of `xml`, after the checks that every refusal passes.
fn refusal(xml: &str) -> String {
    let start = Instant::now();
    let error = load(xml).expect_err("it has to be refused");
    assert!(start.elapsed() < Duration::from_secs(1), "{error}");
    let told = error.explain();
    assert_eq!(told.fault, Fault::Input, "{error}");
    assert!(
        told.file
            .as_ref()
            .is_some_and(|file| file.ends_with("arm.xml")),
        "{told:?}"
    );
    assert!(told.remedy.is_some(), "{error}");
    let said = error.to_string();
    assert!(said.len() < 1000 && !said.contains('\n'), "{said}");
    said
}

/// The arm with `from` replaced by `to`.
fn spoiled(from: &str, to: &str) -> String {
    assert_eq!(ARM.matches(from).count(), 1, "{from}");
    ARM.replacen(from, to, 1)
}

#[test]
fn the_arm_itself_is_sound() {
    let arm = load(ARM).expect("it is sound");
    assert_eq!((arm.bodies.len(), arm.nv), (2, 7));
    assert_eq!(arm.undriven(), None);
}

#[test]
fn numbers_that_cannot_be_are_refused_where_they_stand() {
    for (from, to, place) in [
        ("kp=\"100\"", "kp=\"nan\"", "position `servo`"),
        ("kp=\"100\"", "kp=\"-100\"", "actuator `servo`"),
        ("kp=\"100\"", "kp=\"1e308\"", "position `servo`"),
        ("kv=\"10\"", "kv=\"-1\"", "actuator `servo`"),
        ("kv=\"10\"", "kv=\"inf\"", "position `servo`"),
        ("gear=\"1\"", "gear=\"nan\"", "position `servo`"),
        ("gear=\"1\"", "gear=\"0\"", "joint `elbow`"),
        ("gear=\"1\"", "gear=\"1e9\"", "joint `elbow`"),
        (
            "forcerange=\"-50 50\"",
            "forcerange=\"50 -50\"",
            "actuator `servo`",
        ),
        (
            "forcerange=\"-50 50\"",
            "forcerange=\"-inf 50\"",
            "position `servo`",
        ),
        (
            "ctrlrange=\"-2 0.5\"",
            "ctrlrange=\"0.5 -2\"",
            "actuator `servo`",
        ),
        (
            "range=\"-2 0.5\" damping",
            "range=\"0.5 -2\" damping",
            "joint `elbow`",
        ),
        (
            "range=\"-2 0.5\" damping",
            "range=\"nan 1\" damping",
            "joint `elbow`",
        ),
        ("damping=\"1\"", "damping=\"-1\"", "joint `elbow`"),
        ("stiffness=\"0\"", "stiffness=\"-5\"", "joint `elbow`"),
        ("armature=\"0.01\"", "armature=\"-1\"", "joint `elbow`"),
        (
            "frictionloss=\"0\"",
            "frictionloss=\"nan\"",
            "joint `elbow`",
        ),
        ("axis=\"0 1 0\"", "axis=\"0 0 0\"", "joint `elbow`"),
        (
            "friction=\"0.9 0.005 0.0001\"",
            "friction=\"nan\"",
            "geom `trunk`",
        ),
        (
            "friction=\"0.9 0.005 0.0001\"",
            "friction=\"-0.1\"",
            "geom `trunk`",
        ),
        ("mass=\"20\"", "mass=\"1e308\"", "geom `trunk`"),
        ("mass=\"20\"", "mass=\"1e8\"", "geom `trunk`"),
        ("mass=\"20\"", "mass=\"-20\"", "geom `trunk`"),
        ("mass=\"20\"", "mass=\"0\"", "body `torso`"),
        ("mass=\"20\"", "density=\"-3\"", "geom `trunk`"),
        ("mass=\"20\"", "density=\"1e9\"", "geom `trunk`"),
        ("mass=\"2\" ", "mass=\"-2\" ", "body `arm`"),
        ("mass=\"2\" ", "mass=\"nan\" ", "body `arm`"),
        ("diaginertia=\"0.02 0.01 0.02\"", "", "body `arm`"),
        (
            "diaginertia=\"0.02 0.01 0.02\"",
            "diaginertia=\"0.02 -0.01 0.02\"",
            "body `arm`",
        ),
        (
            "diaginertia=\"0.02 0.01 0.02\"",
            "diaginertia=\"0.1 0.01 0.02\"",
            "body `arm`",
        ),
        ("size=\"0.2\"", "size=\"0\"", "geom `trunk`"),
        ("size=\"0.2\"", "size=\"-0.2\"", "geom `trunk`"),
        ("size=\"0.2\"", "size=\"1e6\"", "geom `trunk`"),
        (
            "fromto=\"0 0 0 0 0.25 0\"",
            "fromto=\"0 0 0 0 0 0\"",
            "geom `bone`",
        ),
        (
            "fromto=\"0 0 0 0 0.25 0\"",
            "fromto=\"0 0 0 0 1e7 0\"",
            "geom `bone`",
        ),
        ("pos=\"0 0.3 0\"", "pos=\"0 inf 0\"", "body `arm`"),
        ("pos=\"0 0.3 0\"", "pos=\"0 1e9 0\"", "body `arm`"),
        ("quat=\"1 0 0 0\"", "quat=\"0 0 0 0\"", "body `torso`"),
        ("quat=\"1 0 0 0\"", "zaxis=\"0 0 0\"", "body `torso`"),
        ("timestep=\"0.005\"", "timestep=\"0\"", "<option>"),
        ("timestep=\"0.005\"", "timestep=\"nan\"", "<option>"),
        ("gravity=\"0 0 -9.81\"", "gravity=\"0 0 nan\"", "<option>"),
        ("boundmass=\"0\"", "settotalmass=\"1e9\"", "body `"),
    ] {
        let said = refusal(&spoiled(from, to));
        assert!(said.contains(place), "{to}: {said}");
    }
}

#[test]
fn a_character_that_nothing_drives_is_refused_with_its_first_joint() {
    let start = ARM.find("  <actuator>").expect("it has actuators");
    let without = format!("{}</mujoco>", &ARM[..start]);
    let idle = [
        without.clone(),
        spoiled("kp=\"100\"", "kp=\"0\""),
        spoiled(
            "forcerange=\"-50 50\"",
            "forcelimited=\"true\" forcerange=\"0 0\"",
        ),
        ARM.replace("<position", "<velocity"),
        // A motor without a limit says nothing about how strong it is.
        ARM.replace("<position", "<motor")
            .replace("forcerange=\"-50 50\" ctrlrange=\"-2 0.5\"", ""),
    ];
    for xml in &idle {
        let said = refusal(xml);
        assert!(said.contains("joint `elbow` of body `arm`"), "{said}");
        assert!(said.contains("<position>"), "{said}");
    }
    // Single joints may swing freely.
    let hand = r#"<body name="hand" pos="0 0.25 0"><joint name="wrist" axis="1 0 0"/>
      <geom type="sphere" size="0.05" mass="0.4"/></body></body></body>"#;
    let ends = "      </body>\n    </body>";
    assert!(load(&spoiled(ends, hand)).is_ok());
    // Its own spring drives a joint as well, and the library can retarget to a character without motors.
    assert!(load(&without.replace("stiffness=\"0\"", "stiffness=\"50\"")).is_ok());
    assert!(Skeleton::from_mjcf("arm", &without, None).is_ok());
}

#[test]
fn actuators_drive_joints_that_are_there() {
    let said = refusal(&spoiled("joint=\"elbow\"", "joint=\"knee\""));
    assert!(
        said.contains("actuator `servo`: it drives joint `knee`"),
        "{said}"
    );
    let said = refusal(&spoiled("name=\"servo\" joint=\"elbow\"", "joint=\"knee\""));
    assert!(said.contains("actuator of joint `knee`"), "{said}");
    let free = ARM.replace("<freejoint/>", "<freejoint name=\"root\"/>");
    let said = refusal(&free.replace("joint=\"elbow\"", "joint=\"root\""));
    assert!(said.contains("joint `root`"), "{said}");
    let twice = "<joint name=\"elbow\" axis=\"1 0 0\"/><inertial pos=\"0 0.1 0\"";
    let said = refusal(&spoiled("<inertial pos=\"0 0.1 0\"", twice));
    assert!(said.contains("`elbow`") && said.contains("twice"), "{said}");
}

/// The arm with `more` beside the geom of the arm.
fn with(more: &str) -> String {
    spoiled("<geom name=\"bone\"", &format!("{more}<geom name=\"bone\""))
}

fn many(count: usize, one: impl Fn(usize) -> String) -> String {
    (0..count).fold(String::new(), |mut text, i| {
        let _ = text.write_str(&one(i));
        text
    })
}

#[test]
fn what_a_character_has_is_counted_before_it_is_parsed() {
    let attributes = many(60_000, |i| format!(" a{i}=\"1\""));
    let cases = [
        (
            with(&many(1000, |_| "<body><joint/></body>".to_owned())),
            "bodies",
        ),
        (
            with(&many(500, |_| "<joint axis=\"1 0 0\"/>".to_owned())),
            "joints",
        ),
        (
            with(&many(20, |_| "<joint axis=\"1 0 0\"/>".to_owned())),
            "21 degrees of freedom",
        ),
        (
            with(&many(100, |_| {
                "<body><joint type=\"ball\"/><geom size=\"1\"/></body>".to_owned()
            })),
            "degrees of freedom",
        ),
        (
            with(&many(5000, |_| "<geom size=\"0.1\"/>".to_owned())),
            "geoms",
        ),
        (with(&many(30_000, |_| "<site/>".to_owned())), "elements"),
        (with(&format!("<site{attributes}/>")), "attributes"),
        (with(&"<body>".repeat(3000)), "nested"),
        (
            ARM.replace(
                "<option",
                &format!("{}<option", "<default class=\"a\">".repeat(30)),
            ),
            "classes are nested",
        ),
        (
            ARM.replace(
                "<option",
                &format!("<default>{}</default><option", "<default/>".repeat(3000)),
            ),
            "default classes",
        ),
        (
            with(&format!("<site name=\"{}\"/>", "x".repeat(10_000))),
            "longer than",
        ),
        (with(&"<![CDATA[x]]>".repeat(1000)), "CDATA"),
        (with("<site xmlns:a=\"b\"/>"), "namespaces"),
        (with(&format!("<!--{}-->", " ".repeat(2 << 20))), "bytes"),
        (
            ARM.replace(
                "<actuator>",
                &format!("<actuator>{}", "<motor joint=\"elbow\"/>".repeat(2000)),
            ),
            "actuators",
        ),
    ];
    for (xml, says) in cases {
        let said = refusal(&xml);
        assert!(said.contains(says), "{says}: {said}");
    }
}

/// The arm's file with more in it: before its end, before its bodies, in the arm, and in the place of `from`.
fn after(section: &str) -> String {
    spoiled("</mujoco>", &format!("{section}</mujoco>"))
}

fn floor(geom: &str) -> String {
    spoiled("<worldbody>", &format!("<worldbody>{geom}"))
}

fn arm(more: &str) -> String {
    spoiled("<body name=\"arm\"", &format!("<body {more} name=\"arm\""))
}

fn refused(cases: Vec<(String, &str)>) {
    for (xml, says) in cases {
        let said = refusal(&xml);
        assert!(said.contains(says), "{says}: {said}");
    }
}

/// What MuJoCo simulates and we don't isn't passed over: the character would learn under other physics than its file states.
#[test]
fn what_is_not_simulated_is_refused_by_its_name() {
    refused(vec![
        (
            after("<equality><weld body1=\"arm\"/></equality>"),
            "<weld> of <equality>",
        ),
        (
            after("<equality><joint joint1=\"elbow\"/></equality>"),
            "<joint> of <equality>",
        ),
        (
            after(
                "<tendon><fixed stiffness=\"5\"><joint joint=\"elbow\" coef=\"1\"/></fixed></tendon>",
            ),
            "`stiffness` of a tendon",
        ),
        (
            after("<tendon><spatial damping=\"1\"/></tendon>"),
            "`damping` of a tendon",
        ),
        (
            after("<default><tendon stiffness=\"2\"/></default>"),
            "`stiffness` of a tendon",
        ),
        (
            spoiled(
                "<position name=\"servo\" joint=\"elbow\"",
                "<position name=\"servo\" tendon=\"elbow\"",
            ),
            "an actuator of a `tendon`",
        ),
        (
            floor("<geom type=\"plane\" size=\"1 1 1\" pos=\"0 0 5\"/>"),
            "z = 0",
        ),
        (
            floor("<geom type=\"plane\" size=\"1 1 1\" pos=\"0 0 -0.1\"/>"),
            "z = 0",
        ),
        (
            floor("<geom type=\"plane\" size=\"1 1 1\" euler=\"0.1 0 0\"/>"),
            "z = 0",
        ),
        (
            floor("<geom type=\"plane\" size=\"1 1 1\" zaxis=\"1 0 0\"/>"),
            "z = 0",
        ),
        (
            floor("<body pos=\"0 0 1\"><geom type=\"plane\" size=\"1 1 1\"/></body>"),
            "z = 0",
        ),
        (
            spoiled(
                "<inertial",
                "<geom type=\"plane\" size=\"1 1 1\"/><inertial",
            ),
            "a plane that moves",
        ),
    ]);
}

#[test]
fn elements_that_mujoco_would_not_read_so_are_refused() {
    refused(vec![
        (floor("<body mocap=\"true\"/>"), "`mocap`"),
        (arm("gravcomp=\"1\""), "`gravcomp`"),
        (
            spoiled("size=\"0.04\"", "size=\"0.04\" condim=\"0\""),
            "`condim` of 0",
        ),
        (
            spoiled("size=\"0.04\"", "size=\"0.04\" condim=\"7\""),
            "`condim` of 7",
        ),
        (
            after("<default><geom condim=\"2\"/></default>"),
            "`condim` of 2",
        ),
        (
            spoiled("size=\"0.04\"", "size=\"0.04 0 0 0 0 0\""),
            "`size` has 6 numbers",
        ),
        (
            spoiled("pos=\"0 0.3 0\"", "pos=\"0 0.3\""),
            "`pos` has 2 numbers",
        ),
        (
            spoiled("forcerange=\"-50 50\"", "forcerange=\"-50 50 9\""),
            "`forcerange` has 3 numbers",
        ),
        (
            spoiled("quat=\"1 0 0 0\"", "quat=\"1 0 0 0\" euler=\"0 0 1\""),
            "`quat` and `euler`",
        ),
        (
            spoiled("quat=\"1 0 0 0\"", "axisangle=\"1 0 0 0\" zaxis=\"0 0 1\""),
            "`axisangle` and `zaxis`",
        ),
        (
            spoiled("forcerange=\"-50 50\"", "forcerange=\"-200 -1\""),
            "doesn't hold 0",
        ),
    ]);
}

/// What changes nothing is let through, and what takes a little freedom away is told.
#[test]
fn what_is_harmless_is_no_reason_to_refuse_a_character() {
    for (xml, told) in [
        (after("<equality/>"), None),
        (arm("gravcomp=\"0\" mocap=\"false\""), None),
        (
            floor("<geom type=\"plane\" size=\"0 0 1\" condim=\"3\"/>"),
            None,
        ),
        (
            floor(
                "<geom type=\"plane\" size=\"1 1 1\" pos=\"0 0 5\" contype=\"0\" conaffinity=\"0\"/>",
            ),
            None,
        ),
        (
            floor(
                "<body pos=\"0 0 1\"><geom type=\"plane\" size=\"1 1 1\" pos=\"0 0 -1\"/></body>",
            ),
            None,
        ),
        (
            after(
                "<tendon><fixed name=\"ham\" range=\"-1 2\"><joint joint=\"elbow\" coef=\"1\"/></fixed></tendon>",
            ),
            Some("tendon `ham`"),
        ),
    ] {
        let found = load(&xml).map(|skeleton| skeleton.left_out().join(" "));
        let found = found.unwrap_or_else(|e| panic!("{e}: {xml}"));
        match told {
            Some(told) => assert!(found.contains(told), "{found}"),
            None => assert_eq!(found, ""),
        }
    }
}

/// A file of slots that is named, but can't be read, isn't as good as none.
#[cfg(unix)]
#[test]
fn slots_that_lead_nowhere_are_no_missing_slots() {
    let folder = tempfile::tempdir().expect("a folder");
    let (mjcf, beside) = (
        folder.path().join("arm.xml"),
        folder.path().join("arm.json"),
    );
    std::fs::write(&mjcf, ARM).expect("it is written");
    for target in ["nowhere.json", "arm.json"] {
        std::os::unix::fs::symlink(target, &beside).expect("a link");
        let told = Skeleton::load(&mjcf)
            .expect_err("it leads nowhere")
            .explain();
        assert_eq!(told.file.as_deref(), Some(beside.as_path()), "{told:?}");
        std::fs::remove_file(&beside).expect("removed");
    }
    assert!(Skeleton::load(&mjcf).is_ok());
}

/// The examples of others.
#[test]
fn known_contradictions_are_refused() {
    for (name, says) in [
        ("act_nojoint", "joint `nope`"),
        ("noactuators", "no actuator drives it"),
        ("fric_nan", "`friction`"),
        ("kp_nan", "`kp`"),
        ("mass_1e308", "`mass`"),
        ("mjcf-hingemany", "joints"),
    ] {
        let Some(path) = foreign(&format!("../cases/solid/{name}.xml")) else {
            return;
        };
        let error = Skeleton::load(&path).expect_err(name);
        assert_eq!(
            error.explain().file.as_deref(),
            Some(path.as_path()),
            "{error}"
        );
        assert!(error.to_string().contains(says), "{error}");
    }
}

#[cfg(unix)]
#[test]
fn only_a_regular_file_is_a_character() {
    let folder = tempfile::tempdir().expect("a folder");
    let pipe = folder.path().join("pipe.xml");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    assert!(made.is_ok_and(|status| status.success()));
    let beside = folder.path().join("arm.json");
    std::os::unix::fs::symlink("/dev/zero", &beside).expect("a link");
    let mjcf = folder.path().join("arm.xml");
    std::fs::write(&mjcf, ARM).expect("it is written");
    for (path, file, what) in [
        (pipe.as_path(), pipe.as_path(), "a pipe"),
        (mjcf.as_path(), beside.as_path(), "a device"),
        (folder.path(), folder.path(), "a folder"),
    ] {
        let told = Skeleton::load(path).expect_err(what).explain();
        assert_eq!(told.file.as_deref(), Some(file));
        assert!(
            told.cause.contains("not a regular file") && told.cause.contains(what),
            "{told}"
        );
    }
}

/// Our own humanoid with one thing about it made odd.
fn odd() -> Vec<(&'static str, String)> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/skeletons/humanoid.xml");
    let humanoid = std::fs::read_to_string(path).expect("our own humanoid");
    let edited = |from: &str, to: &str| {
        assert!(humanoid.contains(from), "{from}");
        humanoid.replace(from, to)
    };
    vec![
        ("as it is", humanoid.clone()),
        (
            "nothing to touch the ground",
            edited(
                "contype=\"1\" conaffinity=\"0\" condim",
                "contype=\"0\" conaffinity=\"0\" condim",
            ),
        ),
        (
            "a name with signs",
            edited("\"head\"", "\"he&quot;ad é&#10;\u{202e} \\ \""),
        ),
        (
            "a long name",
            edited("\"head\"", &format!("\"{}\"", "h".repeat(400))),
        ),
        (
            "no friction",
            edited("friction=\"0.9 0.005 0.0001\"", "friction=\"0 0 0\""),
        ),
        (
            "no force",
            edited("forcerange=\"-200 200\"", "forcerange=\"-1e-9 1e-9\""),
        ),
        ("endless force", edited("forcerange=\"-200 200\"", "")),
        ("a heavy trunk", edited("mass=\"14\"", "mass=\"900000\"")),
        ("a light trunk", edited("mass=\"14\"", "mass=\"1e-8\"")),
        (
            "a narrow range",
            edited("ctrlrange=\"-1 1\"", "ctrlrange=\"0 1e-12\""),
        ),
        (
            "a wide range",
            edited("ctrlrange=\"-1 1\"", "ctrlrange=\"-1e9 1e9\""),
        ),
        (
            "a long neck",
            edited("pos=\"0 0 0.223894\"", "pos=\"0 0 900\""),
        ),
        ("no length", edited("pos=\"0 0 0.223894\"", "pos=\"0 0 0\"")),
        (
            "lying",
            edited(
                "pos=\"0 0 0.881416\"",
                "pos=\"0 0 -500\" euler=\"1.5 0.3 0\"",
            ),
        ),
    ]
}

/// What is written can be read by the next command, whatever the character.
#[test]
fn what_is_retargeted_to_odd_characters_can_be_read_again() {
    let clip = concat!(env!("CARGO_MANIFEST_DIR"), "/clips/kick.fbx");
    let options = import::Options {
        trim: Some((0.2, 0.5)),
        ..import::Options::default()
    };
    let clip = import::load(clip, &options).expect("our own clip");
    let folder = tempfile::tempdir().expect("a folder");
    for (what, mjcf) in odd() {
        let path = folder.path().join("odd.xml");
        std::fs::write(&path, mjcf).expect("it is written");
        let skeleton = Skeleton::load(&path).unwrap_or_else(|e| panic!("{what}: {e}"));
        let made = match retarget(&clip, &skeleton, &retarget::Options::default()) {
            Ok(made) => made,
            Err(error) => {
                assert_eq!(error.explain().fault, Fault::Input, "{what}: {error}");
                continue;
            }
        };
        let path = folder.path().join("odd.motion");
        made.motion
            .save(&path)
            .unwrap_or_else(|e| panic!("{what}: {e}"));
        let read = Motion::load(&path).unwrap_or_else(|e| panic!("{what}: {e}"));
        assert_eq!(read, made.motion, "{what}");
        read.check_skeleton(&skeleton)
            .unwrap_or_else(|e| panic!("{what}: {e}"));
    }
}
