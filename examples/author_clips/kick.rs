//! A front kick with the rear leg, from a fighting stance and back to it.
//!
//! Key poses say where trunk, hands and feet are; curves of least jerk join them; then the pelvis is moved, as little
//! as possible, until the zero-moment point is where a foot can hold it.

use crate::balance::{Body, GRAVITY, Ground};
use crate::figure::{Figure, Foot, Hand, Turn};
use crate::rig::{BALL_HEIGHT, HIPS, Pose, Rig, UP_LEG, V3};
use crate::spline::{MinJerk, jet};
use nalgebra::{DMatrix, DVector};

pub const FPS: f64 = crate::fbx::FPS as f64;
pub const FRAMES: usize = 121;
/// The kicking foot leaves the ground and comes back, s.
pub const LIFT_OFF: f64 = 0.60;
pub const TOUCH_DOWN: f64 = 1.64;
const HEEL_OFF: f64 = 0.26;
const HEEL_DOWN: f64 = 1.88;
const END: f64 = 2.0;

/// Each round measures the true body and corrects by the model below.
const ROUNDS: usize = 20;
/// Part of a round's correction that is taken.
const STEP: f64 = 0.7;
/// Length of the inverted pendulum, m, and the part of the body that goes where the pelvis goes.
const COM_HEIGHT: f64 = 0.95;
const MOVED_FRACTION: f64 = 0.85;
/// Pelvis offsets are kept to a thousandth of a millimetre, so that other machines' rounding gives the same file.
const GRAIN: f64 = 1e-6;

/// One curve per number that is animated.
struct Curves {
    hips: [MinJerk; 3],
    pelvis: [MinJerk; 3],
    trunk: [MinJerk; 3],
    head: [MinJerk; 3],
    wrists: [[MinJerk; 3]; 2],
    /// Yaw, pitch and toe pitch of the kicking foot.
    foot: [MinJerk; 3],
    /// Path of the kicking ankle in the air, as `polar` gives it.
    swing: [MinJerk; 3],
    knee_yaw: MinJerk,
}

fn vector(curves: &[MinJerk; 3], t: f64) -> V3 {
    V3::from_fn(|i, _| curves[i].at(t))
}

fn turn(curves: &[MinJerk; 3], t: f64) -> Turn {
    let [yaw, pitch, roll] = [0, 1, 2].map(|i| curves[i].at(t).to_radians());
    Turn { yaw, pitch, roll }
}

/// Splits keys of three numbers into three curves.
fn curves(keys: &[(f64, [f64; 3])]) -> [MinJerk; 3] {
    [0, 1, 2].map(|i| {
        let points: Vec<(f64, f64)> = keys.iter().map(|(t, v)| (*t, v[i])).collect();
        MinJerk::through(&points)
    })
}

/// The standing foot's ankle, and the kicking foot's ball in the stance: left, forward (m), and turned out (degrees).
const LEFT_ANKLE: [f64; 2] = [0.090, 0.150];
const LEFT_YAW: f64 = 12.0;
const RIGHT_BALL: [f64; 2] = [-0.155, -0.050];
const RIGHT_YAW: f64 = -35.0;

impl Curves {
    /// Metres and degrees.
    fn new(rig: &Rig) -> Self {
        let mut curves = Self::without_swing();
        curves.swing = curves.swing(rig);
        curves
    }

    fn without_swing() -> Self {
        Self {
            hips: curves(&[
                (0.0, [0.060, 0.900, 0.080]),
                (0.50, [0.098, 0.910, 0.135]),
                (0.80, [0.098, 0.924, 0.140]),
                (1.12, [0.110, 0.938, 0.185]),
                (1.44, [0.090, 0.920, 0.125]),
                (1.68, [0.090, 0.906, 0.115]),
                (END, [0.060, 0.900, 0.080]),
            ]),
            pelvis: curves(&[
                (0.0, [-28.0, 4.0, 0.0]),
                (0.62, [-14.0, 3.0, 0.0]),
                (0.90, [6.0, -8.0, -4.0]),
                (1.12, [20.0, -16.0, -6.0]),
                (1.32, [8.0, -9.0, -4.0]),
                (1.60, [-16.0, 3.0, 0.0]),
                (END, [-28.0, 4.0, 0.0]),
            ]),
            trunk: curves(&[
                (0.0, [4.0, 8.0, 0.0]),
                (0.62, [6.0, 8.0, 0.0]),
                (0.90, [-8.0, 10.0, 3.0]),
                (1.12, [-26.0, 3.0, 5.0]),
                (1.30, [-10.0, 12.0, 3.0]),
                (1.60, [6.0, 9.0, 0.0]),
                (END, [4.0, 8.0, 0.0]),
            ]),
            head: curves(&[
                (0.0, [22.0, -6.0, 0.0]),
                (0.62, [8.0, -6.0, 0.0]),
                (1.12, [8.0, 8.0, 0.0]),
                (1.60, [10.0, -6.0, 0.0]),
                (END, [22.0, -6.0, 0.0]),
            ]),
            wrists: [left_wrist(), right_wrist()],
            foot: kicking_foot(),
            swing: curves(&[(LIFT_OFF, [0.0; 3]), (TOUCH_DOWN, [0.0; 3])]),
            knee_yaw: MinJerk::through(&[(0.30, -25.0), (0.90, 0.0), (1.32, 0.0), (1.80, -25.0)]),
        }
    }
}

fn left_wrist() -> [MinJerk; 3] {
    curves(&[
        (0.0, [-0.060, 0.010, 0.330]),
        (0.62, [-0.050, 0.000, 0.310]),
        (1.12, [-0.090, 0.010, 0.270]),
        (1.55, [-0.060, 0.000, 0.310]),
        (END, [-0.060, 0.010, 0.330]),
    ])
}

fn right_wrist() -> [MinJerk; 3] {
    curves(&[
        (0.0, [0.050, -0.010, 0.260]),
        (0.62, [0.040, -0.030, 0.250]),
        (0.86, [-0.060, -0.200, 0.220]),
        (1.12, [-0.200, -0.400, -0.100]),
        (1.30, [-0.080, -0.240, 0.180]),
        (1.60, [0.030, -0.040, 0.240]),
        (END, [0.050, -0.010, 0.260]),
    ])
}

fn kicking_foot() -> [MinJerk; 3] {
    let yaw = [
        (LIFT_OFF, RIGHT_YAW),
        (0.92, 0.0),
        (1.32, 0.0),
        (TOUCH_DOWN, RIGHT_YAW),
    ];
    let pitch = [
        (HEEL_OFF, 0.0),
        (LIFT_OFF, 40.0),
        (0.90, 42.0),
        (1.12, -48.0),
        (1.34, 36.0),
        (TOUCH_DOWN, 28.0),
        (HEEL_DOWN, 0.0),
    ];
    let toes = [
        (LIFT_OFF, 0.0),
        (0.90, 28.0),
        (1.12, -70.0),
        (1.34, 22.0),
        (TOUCH_DOWN, 0.0),
    ];
    [
        MinJerk::through(&yaw),
        MinJerk::through(&pitch),
        MinJerk::through(&toes),
    ]
}

impl Curves {
    fn figure(&self, rig: &Rig, t: f64, offset: Ground) -> Figure {
        let elbows = [V3::new(0.55, -0.8, -0.25), V3::new(-0.55, -0.8, -0.35)];
        Figure {
            hips: vector(&self.hips, t) + V3::new(offset.x, 0.0, offset.y),
            pelvis: turn(&self.pelvis, t),
            trunk: turn(&self.trunk, t),
            head: turn(&self.head, t),
            hands: [0, 1].map(|side| Hand {
                wrist: vector(&self.wrists[side], t),
                elbow: elbows[side],
            }),
            feet: [standing_foot(), self.kicking_foot(rig, t)],
        }
    }

    /// The kicking foot: on its ball, but for the time in the air.
    fn kicking_foot(&self, rig: &Rig, t: f64) -> Foot {
        let mut foot = self.rolling_foot(t);
        if (LIFT_OFF..TOUCH_DOWN).contains(&t) {
            let [length, angle, across] = [0, 1, 2].map(|i| self.swing[i].at(t));
            let reach = V3::new(across, -length * angle.cos(), length * angle.sin());
            foot.ankle = self.nominal_hip(rig, t) + reach;
        }
        let knee_yaw = self.knee_yaw.at(t).to_radians();
        foot.knee_axis = V3::new(knee_yaw.cos(), 0.0, -knee_yaw.sin());
        foot
    }

    fn rolling_foot(&self, t: f64) -> Foot {
        let Turn {
            yaw,
            pitch,
            roll: toes,
        } = turn(&self.foot, t);
        let [x, z] = RIGHT_BALL;
        Foot::on_ball(V3::new(x, BALL_HEIGHT, z), yaw, pitch, toes)
    }

    /// The kicking leg's hip before balancing.
    fn nominal_hip(&self, rig: &Rig, t: f64) -> V3 {
        vector(&self.hips, t) + turn(&self.pelvis, t).quat() * rig.offset(HIPS, UP_LEG[1])
    }

    /// The rolling foot's ankle from the nominal hip: distance in the sagittal plane, angle forward of straight down,
    /// and distance to the left.
    fn polar(&self, rig: &Rig, t: f64) -> [f64; 3] {
        let v = self.rolling_foot(t).ankle - self.nominal_hip(rig, t);
        [v.y.hypot(v.z), v.z.atan2(-v.y), v.x]
    }

    fn swing(&self, rig: &Rig) -> [MinJerk; 3] {
        [0, 1, 2].map(|i| {
            let [start, end] = [LIFT_OFF, TOUCH_DOWN].map(|at| jet(&|t| self.polar(rig, t)[i], at));
            let key = |(t, length, degrees, across): (f64, f64, f64, f64)| {
                (t, [length, degrees.to_radians(), across][i])
            };
            let mut points = vec![(LIFT_OFF, start[0])];
            points.extend(SWING.map(key));
            points.push((TOUCH_DOWN, end[0]));
            MinJerk::between(&points, start, end)
        })
    }
}

/// Key poses of the kicking leg: time, hip to ankle (m), angle forward of straight down (degrees), ankle to the left
/// of the hip (m).
const SWING: [(f64, f64, f64, f64); 3] = [
    (0.90, 0.470, 48.0, 0.000),
    (1.12, 0.840, 97.0, 0.000),
    (1.34, 0.470, 50.0, 0.000),
];

fn standing_foot() -> Foot {
    let [x, z] = LEFT_ANKLE;
    let ankle = V3::new(x, crate::rig::ANKLE_HEIGHT, z);
    Foot::at(ankle, LEFT_YAW.to_radians(), 0.0, 0.0)
}

/// Where the zero-moment point ought to be, and how much that matters.
fn wanted(t: f64) -> (Ground, f64) {
    let between = Ground::new(-0.015, 0.060);
    let standing = Ground::new(0.103, 0.213);
    let weight_on_left = MinJerk::through(&[(0.18, 0.0), (0.50, 1.0)]).at(t)
        - MinJerk::through(&[(TOUCH_DOWN + 0.04, 0.0), (END - 0.10, 1.0)]).at(t);
    let single = (LIFT_OFF - 0.08..TOUCH_DOWN + 0.08).contains(&t);
    (
        between.lerp(&standing, weight_on_left),
        if single { 1.0 } else { 0.1 },
    )
}

fn time(frame: usize) -> f64 {
    frame as f64 / FPS
}

/// The kick, frame by frame.
pub fn poses(rig: &Rig) -> Vec<Pose> {
    let curves = Curves::new(rig);
    let body = Body::new(rig);
    let filter = Filter::new();
    let mut offsets = vec![Ground::zeros(); FRAMES];
    for _ in 0..ROUNDS {
        let poses = figures(rig, &curves, &offsets);
        let error: Vec<Ground> = zmp(&body, rig, &poses)
            .iter()
            .enumerate()
            .map(|(k, p)| wanted(time(k)).0 - p)
            .collect();
        for (offset, change) in offsets.iter_mut().zip(filter.answer(&error)) {
            *offset += change * STEP;
        }
    }
    offsets
        .iter_mut()
        .for_each(|o| o.apply(|v| *v = (*v / GRAIN).round() * GRAIN));
    figures(rig, &curves, &offsets)
}

/// The zero-moment point of every frame; the figure stands still before and after.
pub fn zmp(body: &Body, rig: &Rig, poses: &[Pose]) -> Vec<Ground> {
    let last = poses.len() - 1;
    body.zmp(rig, poses, &poses[0], &poses[last], 1.0 / FPS)
}

fn figures(rig: &Rig, curves: &Curves, offsets: &[Ground]) -> Vec<Pose> {
    let frames = offsets.iter().enumerate();
    frames
        .map(|(k, o)| curves.figure(rig, time(k), *o).pose(rig))
        .collect()
}

/// The smoothest pelvis offsets that move the zero-moment point by given amounts: weighted least squares on the
/// linear inverted pendulum p = x − (h/g) ẍ (Kajita et al., ICRA 2003), with jerk as the price, starting and ending
/// in the same place at rest.
struct Filter {
    /// Offsets from weighted errors.
    gain: DMatrix<f64>,
}

impl Filter {
    /// Against one squared metre of error, per (m/s³)² of jerk and per squared metre between frames at rest.
    const JERK_PRICE: f64 = 2e-10;
    const REST_PRICE: f64 = 1e6;

    fn new() -> Self {
        let n = FRAMES;
        let pendulum = Self::pendulum();
        let weight = DMatrix::from_diagonal(&DVector::from_fn(n, |k, _| wanted(time(k)).1));
        let mut normal = pendulum.transpose() * &weight * &pendulum;
        let mut add = |terms: &[(usize, f64)], price: f64| {
            for (i, a) in terms {
                for (j, b) in terms {
                    normal[(*i, *j)] += price * a * b;
                }
            }
        };
        for k in 3..n {
            let jerk = FPS.powi(6) * Self::JERK_PRICE;
            add(
                &[(k, 1.0), (k - 1, -3.0), (k - 2, 3.0), (k - 3, -1.0)],
                jerk,
            );
        }
        for (i, j) in [(0, 1), (1, 2), (n - 2, n - 1), (n - 3, n - 2), (0, n - 1)] {
            add(&[(i, 1.0), (j, -1.0)], Self::REST_PRICE);
        }
        let solved = normal
            .cholesky()
            .expect("a sum of squares that no offset escapes is definite");
        Self {
            gain: solved.solve(&(pendulum.transpose() * weight)),
        }
    }

    fn pendulum() -> DMatrix<f64> {
        let swing = COM_HEIGHT / GRAVITY * FPS * FPS;
        let mut p = DMatrix::zeros(FRAMES, FRAMES);
        for k in 0..FRAMES {
            p[(k, k)] += MOVED_FRACTION * (1.0 + 2.0 * swing);
            p[(k, k.saturating_sub(1))] -= MOVED_FRACTION * swing;
            p[(k, (k + 1).min(FRAMES - 1))] -= MOVED_FRACTION * swing;
        }
        p
    }

    fn answer(&self, error: &[Ground]) -> Vec<Ground> {
        let column = |i: usize| &self.gain * DVector::from_fn(FRAMES, |k, _| error[k][i]);
        let (x, z) = (column(0), column(1));
        (0..FRAMES).map(|k| Ground::new(x[k], z[k])).collect()
    }
}
