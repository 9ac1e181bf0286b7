use super::*;
use crate::explain::{Explain, Fault, Parameter};
use nalgebra::{Point3, Quaternion, UnitQuaternion};

fn humanoid() -> Skeleton {
    Skeleton::load("humanoid").expect("the built-in humanoid is valid")
}

/// Reproducible numbers in −1..1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn vector(&mut self, count: usize, scale: f64) -> Vec<f64> {
        (0..count).map(|_| self.next() * scale).collect()
    }

    fn rotation(&mut self) -> UnitQuaternion<f64> {
        let q = Quaternion::new(self.next(), self.next(), self.next(), self.next());
        UnitQuaternion::new_normalize(q)
    }

    fn below(&mut self, count: usize) -> usize {
        ((self.next() + 1.0) / 2.0 * count as f64) as usize % count.max(1)
    }
}

/// One body on a free root, with the given joints.
fn limb(joints: &str) -> Skeleton {
    let xml = format!(
        r#"<mujoco><compiler angle="radian"/><worldbody><body name="pelvis"><freejoint/>
        <geom size="0.1"/><body name="left_thigh" pos="0 0 -0.2">{joints}<geom size="0.1"/></body>
        </body></worldbody></mujoco>"#
    );
    Skeleton::from_mjcf("limb", &xml, None).expect("valid MJCF")
}

#[test]
fn the_built_in_humanoid_has_the_published_sizes() {
    let s = humanoid();
    assert_eq!((s.bodies.len(), s.nq, s.nv), (15, 43, 34));
    assert!((s.total_mass() - 45.0).abs() < 1e-12);
    assert_eq!(s.slots.len(), 15);
    let drives: usize = s
        .bodies
        .iter()
        .flat_map(|b| &b.joints)
        .map(|j| j.drives.len())
        .sum();
    assert_eq!(drives, 28);
    let knee = &s.bodies[s.slots[&Slot::LeftLowerLeg]].joints[0];
    let published = Drive {
        kp: 500.0,
        kd: 50.0,
        force_limit: 150.0,
    };
    assert_eq!(knee.drives, [published]);
    assert!((s.leg_length() - (0.421546 + 0.40987 + 0.05)).abs() < 1e-12);
    assert!(s.lowest_point(&s.forward(&s.rest_qpos())).abs() < 1e-12);
}

/// A character lying in its file has the same legs as one that stands.
#[test]
fn leg_length_does_not_depend_on_how_the_file_lies() {
    let standing = humanoid();
    let turned = standing.mjcf.replace(
        r#"<body name="pelvis" "#,
        r#"<body name="pelvis" quat="1 0 1 0" "#,
    );
    let lying = Skeleton::from_mjcf("lying", &turned, None).expect("valid MJCF");
    assert!(lying.bodies[0].rest.rotation.angle() > 1.5);
    assert!((lying.leg_length() - standing.leg_length()).abs() < 1e-9);
}

/// Where a quarter turn at one end of its limits puts the end of the limb: legs and arms move as people's do.
#[test]
fn limits_bend_the_way_people_do() {
    let s = humanoid();
    let at = |bent: Slot, end: Slot, axis: Vector3<f64>, angle: f64| {
        let mut rotations = vec![UnitQuaternion::identity(); s.bodies.len()];
        rotations[s.slots[&bent]] = UnitQuaternion::from_scaled_axis(axis * angle);
        let qpos = s.rotations_to_qpos(&Isometry3::identity(), &rotations, None);
        let poses = s.forward(&qpos);
        (poses[s.slots[&end]].translation.vector - poses[s.slots[&bent]].translation.vector)
            .normalize()
    };
    let limits = |slot: Slot, axis: usize| s.bodies[s.slots[&slot]].joints[0].limits[axis];
    let (x, y) = (Vector3::x(), Vector3::y());

    let [straight, bent] = limits(Slot::LeftLowerLeg, 0);
    assert!(straight == 0.0 && bent > 3.0);
    assert!(
        at(Slot::LeftLowerLeg, Slot::LeftFoot, y, 1.5).x < -0.9,
        "knees bend backwards"
    );
    let [bent, straight] = limits(Slot::RightLowerArm, 0);
    assert!(straight == 0.0 && bent < -3.0);
    assert!(
        at(Slot::RightLowerArm, Slot::RightHand, y, -1.5).x > 0.9,
        "elbows bend forwards"
    );
    let [flexion, extension] = limits(Slot::LeftUpperLeg, 1);
    assert!(-flexion > extension, "hips flex further than they extend");
    assert!(at(Slot::LeftUpperLeg, Slot::LeftLowerLeg, y, -1.5).x > 0.9);
    let [_, outward] = limits(Slot::LeftUpperArm, 0);
    assert!(outward > 3.0, "the left arm lifts to the left");
    assert!(at(Slot::LeftUpperArm, Slot::LeftLowerArm, x, 1.5).y > 0.9);
    let [outward, _] = limits(Slot::RightUpperArm, 0);
    assert!(outward < -3.0, "the right arm lifts to the right");
}

#[test]
fn integration_undoes_differentiation() {
    let (s, mut random) = (humanoid(), Random(2));
    for _ in 0..50 {
        let a = s.integrate(&s.rest_qpos(), &random.vector(s.nv, 2.0), 1.0);
        let b = s.integrate(&a, &random.vector(s.nv, 2.0), 1.0);
        let back = s.integrate(&a, &s.differentiate(&a, &b, 0.1), 0.1);
        let same = s.differentiate(&b, &back, 1.0);
        assert!(same.iter().all(|d| d.abs() < 1e-9));
    }
}

#[test]
fn twists_are_derivatives_of_forward() {
    let s = limb(
        r#"<joint type="slide" axis="1 1 0"/><joint axis="0 1 1" pos="0.1 0 0.2"/><joint axis="1 0 0" pos="0 0.3 0"/>"#,
    );
    let (mut random, dt) = (Random(3), 1e-6);
    for _ in 0..20 {
        let q = s.integrate(&s.rest_qpos(), &random.vector(s.nv, 1.0), 1.0);
        let v = random.vector(s.nv, 1.0);
        let (before, after) = (
            s.forward(&s.integrate(&q, &v, -dt)),
            s.forward(&s.integrate(&q, &v, dt)),
        );
        for (twist, (a, b)) in s.twists(&q, &v).iter().zip(before.iter().zip(&after)) {
            let linear = (b.translation.vector - a.translation.vector) / (2.0 * dt);
            let angular = (b.rotation * a.rotation.inverse()).scaled_axis() / (2.0 * dt);
            assert!((twist.linear - linear).norm() < 1e-7);
            assert!((twist.angular - angular).norm() < 1e-7);
        }
    }
}

#[test]
fn hinge_triples_take_any_rotation_exactly() {
    let orthogonal = r#"<joint axis="1 0 0"/><joint axis="0 1 0"/><joint axis="0 0 1"/>"#;
    let proper = r#"<joint axis="0 0 1"/><joint axis="1 0 0"/><joint axis="0 0 1"/>"#;
    for joints in [orthogonal, proper] {
        let (s, mut random) = (limb(joints), Random(4));
        for _ in 0..200 {
            let rotations = [UnitQuaternion::identity(), random.rotation()];
            let qpos = s.rotations_to_qpos(&Isometry3::identity(), &rotations, None);
            let back = s.joint_rotations(&qpos)[1];
            assert!(back.angle_to(&rotations[1]) < 1e-7);
        }
    }
}

/// Angles made within the limits come back themselves, also where the axes are oblique or only two.
#[test]
fn hinge_angles_within_limits_come_back() {
    let oblique = r#"<joint axis="2 1 1" range="-1 1"/><joint axis="0 -1 1" range="-1 1"/><joint axis="1 0 0.3" range="-1 1"/>"#;
    let two = r#"<joint axis="2 1 1" range="-1 1"/><joint axis="0 -1 1" range="-1 1"/>"#;
    for joints in [oblique, two] {
        let (s, mut random) = (limb(joints), Random(5));
        for _ in 0..200 {
            let mut qpos = s.rest_qpos();
            for angle in &mut qpos[7..] {
                *angle = random.next();
            }
            let rotations = s.joint_rotations(&qpos);
            let root = s.forward(&qpos)[0];
            let back = s.rotations_to_qpos(&root, &rotations, Some(&qpos));
            let error = s.differentiate(&qpos, &back, 1.0);
            assert!(error.iter().all(|e| e.abs() < 1e-6), "{qpos:?} {back:?}");
        }
    }
}

#[test]
fn the_lowest_point_of_tilted_shapes_is_exact() {
    let tilt = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_4);
    let pose = Isometry3::from_parts(Vector3::new(0.0, 0.0, 2.0).into(), tilt);
    let cube = Shape::Box {
        pose: Isometry3::identity(),
        half: Vector3::repeat(0.5),
    };
    assert!((cube.lowest(&pose) - (2.0 - 0.5_f64.sqrt())).abs() < 1e-12);
    let capsule = Shape::Capsule {
        a: Vector3::new(0.0, -1.0, 0.0),
        b: Vector3::new(0.0, 1.0, 0.0),
        radius: 0.1,
    };
    assert!((capsule.lowest(&pose) - (2.0 - 0.5_f64.sqrt() - 0.1)).abs() < 1e-12);
}

/// A dumb-bell turning about its centre: L = I ω, and moving it changes nothing.
#[test]
fn angular_momentum_is_about_the_centre_of_mass() {
    let s = limb("");
    let mut qvel = vec![0.0; s.nv];
    qvel[..3].copy_from_slice(&[3.0, -2.0, 1.0]);
    qvel[3] = 2.0;
    let qpos = s.rest_qpos();
    let (linear, angular) = s.momentum(&s.forward(&qpos), &s.twists(&qpos, &qvel));
    let ball = 1000.0 * 4.0 / 3.0 * std::f64::consts::PI * 0.001;
    let spin = 2.0 * (2.0 * 0.4 * ball * 0.01 + 2.0 * ball * 0.01);
    assert!((angular - Vector3::new(spin, 0.0, 0.0)).norm() < 1e-9);
    let center_velocity = Vector3::new(3.0, -2.0, 1.0)
        + Vector3::new(2.0, 0.0, 0.0).cross(&Vector3::new(0.0, 0.0, -0.1));
    assert!((linear - center_velocity * 2.0 * ball).norm() < 1e-9);
    let com = s.com(&s.forward(&qpos));
    assert!((Point3::from(com).z - 0.2).abs() < 1e-12);
}

#[test]
fn errors_say_where_and_what() {
    let doc = |body: &str| format!("<mujoco><worldbody>{body}</worldbody></mujoco>");
    let cases = [
        ("<mujoco>".to_owned(), "not valid MJCF"),
        (doc(r#"<body name="a"><joint/></body>"#), "freejoint"),
        (doc(r#"<body name="a"><freejoint/></body>"#), "no mass"),
        (
            doc(r#"<body name="a"><freejoint/><geom/></body>"#),
            "`size`",
        ),
        (
            doc(r#"<include file="/etc/passwd"/>"#),
            "<include> is not supported",
        ),
        (doc(&"<body>".repeat(200)), "nested"),
        (
            doc(
                r#"<body name="a"><freejoint/><geom size="1"/><body><joint axis="0 0 0"/></body></body>"#,
            ),
            "`axis`",
        ),
        (
            doc(r#"<body name="a"><freejoint/><geom size="1"/><body name="a"/></body>"#),
            "twice",
        ),
        (
            r#"<mujoco><compiler eulerseq="xyzx"/></mujoco>"#.to_owned(),
            "eulerseq",
        ),
    ];
    for (xml, expected) in cases {
        let error = Skeleton::from_mjcf("bad", &xml, None).expect_err(&xml);
        let told = error.explain();
        assert_eq!(told.fault, Fault::Input, "{error}");
        assert!(error.to_string().contains(expected), "{error}");
        assert!(told.place.is_some_and(|p| p.contains("`bad`")), "{error}");
        assert!(
            told.remedy.is_some_and(|r| r.parameter.is_none()),
            "{error}"
        );
    }
    let unknown = Skeleton::load("nobody").expect_err("no such skeleton");
    let remedy = unknown.explain().remedy.expect("what to do instead");
    assert!(remedy.advice.contains("humanoid"), "{unknown}");
    assert_eq!(remedy.parameter, Some(Parameter::Skeleton));
}

/// A character that is read from a file is named by its file, and its slots by theirs.
#[test]
fn errors_name_the_file_that_is_wrong() {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let (xml, json) = (folder.path().join("a.xml"), folder.path().join("a.json"));
    let file = || {
        Skeleton::load(&xml)
            .expect_err("it is wrong")
            .explain()
            .file
    };
    assert_eq!(file(), Some(xml.clone()), "it isn't there");
    std::fs::write(&xml, "<mujoco>").expect("it can be written");
    assert_eq!(file(), Some(xml.clone()), "it is cut off");
    std::fs::write(&xml, humanoid().mjcf).expect("it can be written");
    std::fs::write(&json, r#"{"slots": {"hips": "tail"}}"#).expect("it can be written");
    assert_eq!(file(), Some(json.clone()), "it names no body");
}

/// A file damaged anywhere gives a skeleton or an error.
#[test]
fn damaged_files_never_panic() {
    let text = humanoid().mjcf;
    let mut random = Random(6);
    let pieces = [
        "", "<", ">", "\"", "/>", "-", "nan", "1e999", "<body>", "</body>", "0 0 0", "é",
    ];
    for _ in 0..3000 {
        let mut bytes = text.clone().into_bytes();
        for _ in 0..=random.below(3) {
            let at = random.below(bytes.len());
            let end = (at + random.below(8)).min(bytes.len());
            let piece = pieces[random.below(pieces.len())];
            bytes.splice(at..end, piece.bytes());
        }
        if random.below(4) == 0 {
            bytes.truncate(random.below(bytes.len()));
        }
        let damaged = String::from_utf8_lossy(&bytes);
        if let Ok(s) = Skeleton::from_mjcf("damaged", &damaged, None) {
            assert!(s.leg_length().is_finite());
        }
    }
}

#[test]
fn torque_motors_become_drives() {
    let with_motor = |joint: &str| {
        let xml = format!(
            r#"<mujoco><compiler angle="radian"/><worldbody><body name="pelvis"><freejoint/><geom size="0.1"/>
            <body name="l_shin"><joint name="k" {joint}/><geom size="0.1"/></body></body></worldbody>
            <actuator><motor joint="k" gear="100" ctrlrange="-1 1"/></actuator></mujoco>"#
        );
        let s = Skeleton::from_mjcf("motor", &xml, None).expect("valid MJCF");
        assert_eq!(s.slots[&Slot::LeftLowerLeg], 1);
        s.bodies[1].joints[0].drives[0]
    };
    let noted = with_motor(r#"stiffness="500" damping="50""#);
    assert_eq!(
        (noted.kp, noted.kd, noted.force_limit),
        (500.0, 50.0, 100.0)
    );
    let passive = with_motor(r#"stiffness="5" damping="1""#);
    assert_eq!(
        (passive.kp, passive.kd, passive.force_limit),
        (400.0, 40.0, 100.0)
    );
}

/// The deepest tree that the guard lets through fits a thread's usual stack.
#[test]
fn deep_trees_load() {
    let open = r#"<body><joint axis="0 1 0"/><geom size="0.1"/>"#.repeat(90);
    let xml = format!(
        r#"<mujoco><worldbody><body name="pelvis"><freejoint/><geom size="0.1"/>{open}{}</body></worldbody></mujoco>"#,
        "</body>".repeat(90)
    );
    let s = Skeleton::from_mjcf("deep", &xml, None).expect("valid MJCF");
    assert_eq!((s.bodies.len(), s.nq), (91, 97));
}
