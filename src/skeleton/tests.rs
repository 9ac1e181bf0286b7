use super::*;

fn humanoid() -> Skeleton {
    Skeleton::load("humanoid").expect("the built-in humanoid is valid")
}

#[test]
fn the_built_in_humanoid_has_the_published_sizes() {
    let s = humanoid();
    assert_eq!((s.bodies.len(), s.nq, s.nv), (15, 43, 34));
    let mass: f64 = s.bodies.iter().map(|b| b.mass).sum();
    assert!((mass - 45.0).abs() < 1e-12);
    assert_eq!(s.slots.len(), 15);
    let knee = &s.bodies[s.slots[&Slot::LeftLowerLeg]].joints[0];
    assert_eq!(knee.drives[0].kp, 500.0);
    assert_eq!(knee.drives[0].force_limit, 150.0);
    let shoulder = &s.bodies[s.slots[&Slot::LeftUpperArm]].joints[0];
    assert_eq!(shoulder.limits, [[-0.5, 3.14], [-3.14, 0.7], [-1.5, 1.5]]);
}
