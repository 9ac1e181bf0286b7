//! Skeletons that can be loaded but not simulated.

use super::*;
use crate::explain::{Explain, Fault};

#[test]
fn errors_name_the_body_and_say_what_to_do() {
    let cases = [
        (r#"<joint name="j" type="slide"/>"#, "slide"),
        (r#"<joint type="ball"/><joint name="j"/>"#, "2 joints"),
        (
            r#"<joint axis="0 1 0"/><joint name="j" axis="0 -1 0"/>"#,
            "same axis",
        ),
    ];
    for (joints, expected) in cases {
        let text = format!(
            r#"<mujoco><worldbody><body name="top"><freejoint/><geom size="0.1"/>
            <body name="limb">{joints}<geom size="0.1"/></body></body></worldbody></mujoco>"#
        );
        let skeleton = Skeleton::from_mjcf("limb", &text, None).expect("the text is MJCF");
        let error = Character::new(&skeleton).expect_err(joints);
        let told = error.explain();
        assert_eq!(told.fault, Fault::Input, "{error}");
        assert!(told.cause.contains(expected), "{error}");
        assert!(told.place.is_some_and(|p| p.contains("`limb`")), "{error}");
        assert!(told.remedy.is_some(), "{error}");
    }
}
