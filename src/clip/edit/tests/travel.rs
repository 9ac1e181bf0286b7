use super::*;
use approx::assert_relative_eq;
use nalgebra::Vector2;

#[test]
fn a_walk_in_place_keeps_its_sway() {
    let walk = ours("walk.glb");
    // The walk is authored at 1.2 m/s straight ahead.
    let velocity = walk.mean_velocity().expect("a velocity");
    assert_relative_eq!(velocity, Vector2::new(1.2, 0.0), epsilon = 1e-5);
    let there = walk.in_place().expect("it stays");
    assert!(there.mean_velocity().expect("a velocity").norm() < 1e-9);
    for f in 0..walk.frames.len() {
        let mut wanted = place(&walk, "Hips", f);
        wanted.x -= 1.2 * f as f64 / 30.0;
        assert_relative_eq!(place(&there, "Hips", f), wanted, epsilon = 1e-5);
        assert_eq!(walk.frames[f][5], there.frames[f][5]);
    }
    let again = there.travel(velocity).expect("it travels");
    for (a, b) in walk.frames.iter().zip(&again.frames) {
        assert!(apart(a, b) < 1e-12);
    }
}

#[test]
fn travel_is_in_the_world_under_any_still_parent() {
    let Some(clip) = theirs("mixamo/Xbot.glb", Some("walk")) else {
        return;
    };
    let faster = clip.travel(Vector2::new(0.5, -0.25)).expect("it travels");
    for f in 0..clip.frames.len() {
        let (here, there) = (clip.world(f), faster.world(f));
        let t = f as f64 / clip.fps;
        let moved = clip
            .joints
            .iter()
            .position(|joint| joint.name.ends_with("Head"));
        let moved = moved.expect("a head");
        let step = there[moved].translation.vector - here[moved].translation.vector;
        assert_relative_eq!(step, Vector3::new(0.5 * t, -0.25 * t, 0.0), epsilon = 1e-6);
    }
}
