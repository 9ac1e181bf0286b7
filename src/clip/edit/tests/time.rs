use super::*;
use approx::assert_relative_eq;
use std::f64::consts::TAU;

/// A joint whose place and turn are given as functions of time.
fn moved(
    fps: f64,
    frames: usize,
    place: impl Fn(f64) -> Vector3<f64>,
    angle: impl Fn(f64) -> f64,
) -> Clip {
    let frame = |f: usize| {
        let t = f as f64 / fps;
        let turn = about(Vector3::new(1.0, -2.0, 0.5), angle(t));
        vec![Isometry3::from_parts(place(t).into(), turn)]
    };
    let joints = vec![joint("root", None, Isometry3::identity())];
    clip(joints, fps, (0..frames).map(frame).collect())
}

#[test]
fn constant_velocity_stays_constant_at_any_rate() {
    let line = |t: f64| Vector3::new(2.0 * t, -t, 1.0);
    let steady = moved(30.0, 31, line, |t| 1.5 * t);
    for fps in [17.0, 24.0, 60.0, 144.0] {
        let other = steady.resample(fps).expect("it resamples");
        assert_relative_eq!(other.duration(), 1.0, epsilon = 1e-12);
        for (f, frame) in other.frames.iter().enumerate() {
            let t = f as f64 / other.fps;
            assert_relative_eq!(frame[0].translation.vector, line(t), epsilon = 1e-12);
            let wanted = about(Vector3::new(1.0, -2.0, 0.5), 1.5 * t);
            assert!(frame[0].rotation.angle_to(&wanted) < 1e-7);
        }
    }
}

/// Between its frames a parabola, such as a ballistic flight, is met exactly, and a swing with an error of fourth order.
#[test]
fn curved_ways_stay_curved() {
    let flight = |t: f64| Vector3::new(t, 0.0, 3.0 * t - 4.905 * t * t);
    let fine = moved(10.0, 8, flight, |_| 0.0)
        .resample(200.0)
        .expect("it resamples");
    for (f, frame) in fine.frames.iter().enumerate() {
        let t = f as f64 / 200.0;
        assert_relative_eq!(frame[0].translation.vector, flight(t), epsilon = 1e-12);
    }
    let swing = |t: f64| Vector3::new((TAU * t).sin(), 0.0, 0.0);
    let error = |fps: f64| {
        let coarse = moved(fps, fps as usize + 1, swing, |_| 0.0);
        let fine = coarse.resample(8.0 * fps).expect("it resamples");
        // Away from the ends, where there are frames on both sides.
        let inner = fine.frames.len() / 4..3 * fine.frames.len() / 4;
        let errors = inner.map(|f| {
            let t = f as f64 / fine.fps;
            (fine.frames[f][0].translation.vector - swing(t)).norm()
        });
        errors.fold(0.0, f64::max)
    };
    let (coarse, fine) = (error(20.0), error(40.0));
    assert!(fine < coarse / 6.0, "{coarse} {fine}");
}

#[test]
fn twice_the_speed_is_half_the_time() {
    let walk = ours("walk.glb");
    let fast = walk.speed(2.0, walk.fps).expect("it speeds up");
    assert_relative_eq!(fast.duration(), 0.5 * walk.duration(), epsilon = 0.02);
    assert_eq!(fast.loop_mode, walk.loop_mode);
    let velocity = |clip: &Clip| clip.mean_velocity().expect("a velocity").x;
    let factor = velocity(&fast) / velocity(&walk);
    assert_relative_eq!(factor, walk.duration() / fast.duration(), epsilon = 1e-9);
    let slow = walk.speed(0.25, walk.fps).expect("it slows down");
    for (f, frame) in walk.frames.iter().enumerate() {
        assert!(local_change(frame, &slow.frames[4 * f]) < 1e-12);
    }
    let same = walk.speed(1.0, walk.fps).expect("nothing changes");
    assert_eq!(same.frames, walk.frames);
}

#[test]
fn a_warp_brings_each_moment_to_its_time() {
    // The place says the time.
    let clock = moved(50.0, 51, |t| Vector3::new(t, 0.0, 0.0), |_| 0.0);
    let points = [(0.0, 0.0), (0.5, 0.8), (1.0, 1.0)];
    let warped = clock.warp(&points, 100.0).expect("it warps");
    let time = |f: usize| warped.frames[f][0].translation.x;
    assert_eq!(warped.frames.len(), 101);
    assert_relative_eq!(time(0), 0.0);
    assert_relative_eq!(time(80), 0.5, epsilon = 1e-9);
    assert_relative_eq!(time(100), 1.0, epsilon = 1e-9);
    let steps: Vec<f64> = (1..101).map(|f| time(f) - time(f - 1)).collect();
    assert!(steps.iter().all(|step| *step > 0.0), "time never runs back");
    let kink = steps
        .windows(2)
        .map(|w| (w[1] - w[0]).abs())
        .fold(0.0, f64::max);
    // From 0.625 to 2.5 times the speed: one jump would be 0.01875.
    assert!(kink < 0.003, "{kink}");
    // After the last point time runs as before.
    let later = clock.warp(&[(0.5, 0.25)], 100.0).expect("it warps");
    assert_relative_eq!(later.duration(), 0.75, epsilon = 1e-12);
    for wrong in [
        &[(0.5, 0.8), (0.4, 1.0)][..],
        &[(0.5, 0.8), (0.6, 0.7)],
        &[(2.0, 1.0)],
        &[(0.0, 0.5)],
        &[(0.5, f64::INFINITY)],
    ] {
        assert!(clock.warp(wrong, 100.0).is_err(), "{wrong:?}");
    }
}
