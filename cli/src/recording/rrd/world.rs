//! The three-dimensional scene: bodies, centre of mass, angular momentum, contacts and shoves.

use super::look::{self, Rgba};
use super::names::FOLLOWED;
use crate::recording::content::{Actor, Part, Recording, Side};
use mimic::skeleton::Shape;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rerun::{
    Arrows3D, Boxes3D, Capsules3D, Ellipsoids3D, FillMode, LineStrips3D, Points3D, Quaternion,
    RecordingStream, RecordingStreamResult, TimeColumn, Transform3D, ViewCoordinates,
};

/// Length of the longest arrow of angular momentum, metres. Chosen: about a leg.
const LONGEST_ARROW: f64 = 0.7;
/// Least angular momentum that gets the longest arrow, kg·m²/s. Chosen so that a still character shows no big arrows.
const LEAST_MOMENTUM: f64 = 3.0;

/// Impulse of a shove whose arrow is a metre long, N·s. Chosen: about 1 m/s for a character of 45 kg.
const IMPULSE_PER_METER: f64 = 40.0;
/// How long a shove stays visible, seconds. Chosen: it lasts one frame, and the eye needs a moment.
const SHOVE_SHOWN_S: f64 = 0.4;

/// The viewer keeps the bounds of the entity it follows in view. Two specks, each this far from the centre of mass,
/// metres, make these bounds those of a grown person.
const FRAMED: [f64; 3] = [0.45, 0.45, 0.65];

/// Logs everything below `world`.
pub fn log(
    stream: &RecordingStream,
    shown: &Recording,
    times: &[TimeColumn],
) -> RecordingStreamResult<()> {
    stream.log_static("world", &ViewCoordinates::RIGHT_HAND_Z_UP())?;
    let per_meter = arrow_scale(shown);
    for (name, actor) in shown.actors() {
        let branch = format!("world/{name}");
        let lead = shown.agent.is_none() || name == "agent";
        if name == "reference" {
            let aside = [0.0, -shown.beside as f32, 0.0];
            stream.log_static(branch.as_str(), &Transform3D::from_translation(aside))?;
        }
        bodies(stream, &branch, shown, actor, lead, times)?;
        momentum(stream, &branch, name, actor, per_meter, times)?;
        contacts(stream, &branch, name, shown, actor, times)?;
    }
    shoves(stream, shown, times)?;
    trail(stream, shown)
}

fn bodies(
    stream: &RecordingStream,
    branch: &str,
    shown: &Recording,
    actor: &Actor,
    lead: bool,
    times: &[TimeColumn],
) -> RecordingStreamResult<()> {
    for (index, part) in shown.parts.iter().enumerate() {
        let path = format!("{branch}/bodies/{}", part.name);
        shapes(stream, &path, part, lead)?;
        let poses = actor.poses.iter().filter_map(|frame| frame.get(index));
        let (places, turns): (Vec<_>, Vec<_>) = poses.map(place_and_turn).unzip();
        let moves = Transform3D::update_fields()
            .with_many_translation(places)
            .with_many_quaternion(turns);
        stream.send_columns(path, times.to_vec(), moves.columns_of_unit_batches()?)?;
    }
    Ok(())
}

/// Logs the shapes of a body once: only its transform changes over time.
fn shapes(
    stream: &RecordingStream,
    path: &str,
    part: &Part,
    lead: bool,
) -> RecordingStreamResult<()> {
    let dress: fn(Side) -> Rgba = if lead { look::solid } else { look::ghost };
    let color = look::color(dress(part.side));
    let (mut centers, mut radii) = (Vec::new(), Vec::new());
    let (mut rods, mut thicknesses, mut lengths) = (Vec::new(), Vec::new(), Vec::new());
    let (mut boxes, mut halves) = (Vec::new(), Vec::new());
    for shape in &part.shapes {
        match shape {
            Shape::Sphere { center, radius } => {
                centers.push(vec3(center));
                radii.push(*radius as f32);
            }
            Shape::Capsule { a, b, radius } => {
                rods.push(place_and_turn(&along(a, b)));
                thicknesses.push(*radius as f32);
                lengths.push((b - a).norm() as f32);
            }
            Shape::Box { pose, half } => {
                boxes.push(place_and_turn(pose));
                halves.push(vec3(half));
            }
        }
    }
    if !centers.is_empty() {
        let balls = Ellipsoids3D::from_centers_and_radii(centers, radii).with_colors([color]);
        stream.log_static(path, &balls.with_fill_mode(FillMode::Solid))?;
    }
    if !rods.is_empty() {
        let (places, turns): (Vec<_>, Vec<_>) = rods.into_iter().unzip();
        let rods = Capsules3D::from_lengths_and_radii(lengths, thicknesses)
            .with_translations(places)
            .with_quaternions(turns);
        let rods = rods.with_colors([color]).with_fill_mode(FillMode::Solid);
        stream.log_static(path, &rods)?;
    }
    if !boxes.is_empty() {
        let (places, turns): (Vec<_>, Vec<_>) = boxes.into_iter().unzip();
        let boxes = Boxes3D::from_centers_and_half_sizes(places, halves).with_quaternions(turns);
        let boxes = boxes.with_colors([color]).with_fill_mode(FillMode::Solid);
        stream.log_static(path, &boxes)?;
    }
    Ok(())
}

/// Draws the centre of mass, the specks around it that the eye follows, and the angular momentum about it.
fn momentum(
    stream: &RecordingStream,
    branch: &str,
    name: &str,
    actor: &Actor,
    per_meter: f64,
    times: &[TimeColumn],
) -> RecordingStreamResult<()> {
    let color = look::color(look::of_actor(name));
    let path = format!("{branch}/com");
    let style = Points3D::update_fields().with_colors([color]);
    stream.log_static(path.as_str(), &style.with_radii([0.025]))?;
    followed(stream, branch, actor, times)?;

    let com = actor.com.iter().map(vec3);
    let points = Points3D::update_fields().with_positions(com.clone());
    stream.send_columns(path, times.to_vec(), points.columns_of_unit_batches()?)?;

    let path = format!("{branch}/angular_momentum");
    let style = Arrows3D::update_fields().with_colors([color]);
    stream.log_static(path.as_str(), &style.with_radii([0.012]))?;
    let momenta = actor.angular_momentum.iter();
    let arrows = Arrows3D::update_fields()
        .with_origins(com)
        .with_vectors(momenta.map(|l| vec3(&(l / per_meter))));
    stream.send_columns(path, times.to_vec(), arrows.columns_of_unit_batches()?)
}

/// Draws the two specks whose bounds the eye follows; they are too small to be seen.
fn followed(
    stream: &RecordingStream,
    branch: &str,
    actor: &Actor,
    times: &[TimeColumn],
) -> RecordingStreamResult<()> {
    let framed = Vector3::from(FRAMED);
    let pair = |com: &Vector3<f64>| [vec3(&(com - framed)), vec3(&(com + framed))];
    let specks: Vec<_> = actor.com.iter().flat_map(pair).collect();
    let lengths = vec![2; actor.com.len()];
    let specks = Points3D::update_fields()
        .with_positions(specks)
        .columns(lengths)?;
    let path = format!("{branch}/{FOLLOWED}");
    let style = Points3D::update_fields().with_radii([0.0002]);
    stream.log_static(path.as_str(), &style)?;
    stream.send_columns(path, times.to_vec(), specks)
}

/// Draws a dot on the ground below every body that touches it.
fn contacts(
    stream: &RecordingStream,
    branch: &str,
    name: &str,
    shown: &Recording,
    actor: &Actor,
    times: &[TimeColumn],
) -> RecordingStreamResult<()> {
    let mut dots = Vec::new();
    let mut lengths = Vec::with_capacity(actor.contact.len());
    for (poses, touching) in actor.poses.iter().zip(&actor.contact) {
        let before = dots.len();
        for (part, _) in shown
            .contact_parts
            .iter()
            .zip(touching)
            .filter(|(_, t)| **t)
        {
            let place = poses.get(*part).map(|pose| pose.translation.vector);
            dots.extend(place.map(|p| [p.x as f32, p.y as f32, 0.005]));
        }
        lengths.push(dots.len() - before);
    }
    let path = format!("{branch}/contacts");
    let style = Points3D::update_fields()
        .with_colors([look::color(look::of_actor(name))])
        .with_radii([0.04]);
    stream.log_static(path.as_str(), &style)?;
    let dots = Points3D::update_fields()
        .with_positions(dots)
        .columns(lengths)?;
    stream.send_columns(path, times.to_vec(), dots)
}

/// Draws an arrow at each shove, for a moment. It ends where the agent is hit.
fn shoves(
    stream: &RecordingStream,
    shown: &Recording,
    times: &[TimeColumn],
) -> RecordingStreamResult<()> {
    let Some(agent) = shown.agent.as_ref().filter(|_| !shown.shoves.is_empty()) else {
        return Ok(());
    };
    let (mut ends, mut arrows, mut lengths) = (Vec::new(), Vec::new(), Vec::new());
    for (frame, poses) in agent.poses.iter().enumerate() {
        let now = frame as f64 / shown.fps;
        let shove = shown.shoves.iter().rfind(|shove| shove.at_s <= now);
        let shove = shove.filter(|shove| now < shove.at_s + SHOVE_SHOWN_S);
        let before = arrows.len();
        if let Some((shove, trunk)) = shove.zip(poses.get(shown.trunk)) {
            let arrow = Vector3::from(shove.impulse.map(f64::from)) / IMPULSE_PER_METER;
            ends.push(vec3(&(trunk.translation.vector - arrow)));
            arrows.push(vec3(&arrow));
        }
        lengths.push(arrows.len() - before);
    }
    let path = "world/agent/shove";
    let style = Arrows3D::update_fields()
        .with_colors([look::color(look::SHOVE)])
        .with_radii([0.025]);
    stream.log_static(path, &style)?;
    let arrows = Arrows3D::update_fields()
        .with_origins(ends)
        .with_vectors(arrows)
        .columns(lengths)?;
    stream.send_columns(path, times.to_vec(), arrows)
}

/// Draws the path of the reference's centre of mass.
fn trail(stream: &RecordingStream, shown: &Recording) -> RecordingStreamResult<()> {
    let way: Vec<_> = shown.reference.com.iter().map(vec3).collect();
    let line = LineStrips3D::new([way])
        .with_colors([look::color(look::TRAIL)])
        .with_radii([0.004]);
    stream.log_static("world/reference/com_trail", &line)
}

/// Angular momentum per metre of arrow; the same for all characters, so that they can be compared.
fn arrow_scale(shown: &Recording) -> f64 {
    let momenta = shown
        .actors()
        .flat_map(|(_, actor)| &actor.angular_momentum);
    let largest = momenta.map(|l| l.norm()).fold(LEAST_MOMENTUM, f64::max);
    largest / LONGEST_ARROW
}

/// The frame at `a` whose Z axis points at `b`: the viewer draws capsules along Z.
pub(super) fn along(a: &Vector3<f64>, b: &Vector3<f64>) -> Isometry3<f64> {
    let half_turn = || UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let turn = UnitQuaternion::rotation_between(&Vector3::z(), &(b - a)).unwrap_or_else(half_turn);
    Isometry3::from_parts((*a).into(), turn)
}

fn place_and_turn(pose: &Isometry3<f64>) -> ([f32; 3], Quaternion) {
    let q = pose.rotation.coords.map(|c| c as f32);
    (
        vec3(&pose.translation.vector),
        Quaternion::from_xyzw(q.into()),
    )
}

fn vec3(v: &Vector3<f64>) -> [f32; 3] {
    v.map(|c| c as f32).into()
}
