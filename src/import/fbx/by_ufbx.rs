//! ASCII, big-endian and old FBX files: the C library `ufbx` reads them and evaluates their curves.

use super::contents::{bound, constraints_left_out, contents};
use super::error::FbxError;
use super::numbers::in_range;
use super::settings::Settings;
use super::takes::{first_sane, rate, span_problems};
use super::transform::{Inherit, Local, Property, World};
use crate::explain::Explanation;
use crate::import::bind::Binds;
use crate::import::scene::{Contents, Node, Scene, Take};
use nalgebra::{Matrix3, Matrix4, Quaternion, UnitQuaternion, Vector3};
use std::time::{Duration, Instant};
use ufbx::{AllocatorOpts, ElementType, LoadOpts, OpenFileCb, ProgressCb, ProgressResult};

/// Bytes that ufbx may allocate for any file, and how many more per byte of the file: once for what it keeps, and once for what
/// it needs while reading; of a text, fewer per letter and more for any. Chosen. It uses Rust's allocator.
const FREE_BYTES: usize = 8 << 20;
const FREE_OF_TEXT: usize = 24 << 20;
const BYTES_PER_BYTE: usize = 31;
const BYTES_PER_LETTER: usize = 7;
/// Longest time that reading may take for any file and for each MiB of it, and after how many bytes the clock is checked.
/// Chosen: files of a gigabyte take seconds.
const MOST_TIME: Duration = Duration::from_secs(1);
const LOOK_EVERY: u64 = 1 << 16;

/// Most look-ups that all takes together may need to place the nodes once: ufbx looks up every node, and every property that
/// is driven, in every layer. Chosen: real files need a thousandth.
const MOST_LOOKUPS: usize = 1 << 24;

/// Elements that, attached to a node, leave it nothing but a transform.
const PLAIN: [ElementType; 4] = [
    ElementType::Unknown,
    ElementType::Bone,
    ElementType::Empty,
    ElementType::Marker,
];

/// A file as ufbx has read it.
pub(super) struct UfbxScene {
    contents: Contents,
    scene: ufbx::SceneRoot,
    /// ufbx's index of every node.
    ids: Vec<usize>,
    /// Ticks per second.
    ticks: f64,
}

pub(super) fn read(bytes: &[u8]) -> Result<UfbxScene, FbxError> {
    let scene = load(bytes)?;
    let settings = settings(&scene);
    let (nodes, ids) = tree(&scene);
    let constrained = !scene.constraints.is_empty();
    let problems = constrained.then(constraints_left_out);
    let mut places = vec![None; scene.nodes.len()];
    for (at, &id) in ids.iter().enumerate() {
        places[id] = Some(at);
    }
    let mut budget = MOST_LOOKUPS;
    let stacks = (&scene.anim_stacks).into_iter();
    let takes = stacks
        .map(|stack| take(stack, &settings, &places, &mut budget))
        .collect();
    let binds = binds(&scene, &nodes, &places);
    let mut scene = UfbxScene {
        ticks: settings.ticks,
        contents: contents(settings, nodes, takes, Vec::from_iter(problems)),
        scene,
        ids,
    };
    if let Some((world, problem)) = bound(&scene, binds) {
        scene.contents.bound = Some(world);
        scene.contents.problems.push(problem);
    }
    Ok(scene)
}

/// Reads the bytes, and no other file.
fn load(bytes: &[u8]) -> Result<ufbx::SceneRoot, FbxError> {
    let (per_byte, free) = match super::is_ascii(bytes) {
        true => (BYTES_PER_LETTER, FREE_OF_TEXT),
        false => (BYTES_PER_BYTE, FREE_BYTES),
    };
    let limit = || AllocatorOpts {
        memory_limit: bytes.len().saturating_mul(per_byte).saturating_add(free),
        ..AllocatorOpts::default()
    };
    let start = Instant::now();
    let most_time = MOST_TIME.mul_f64(1.0 + bytes.len() as f64 / f64::from(1 << 20));
    let in_time = |_: &ufbx::Progress| match start.elapsed() < most_time {
        true => ProgressResult::Continue,
        false => ProgressResult::Cancel,
    };
    let nothing_beside = |_: &str, _: &ufbx::OpenFileInfo| None;
    let options = LoadOpts {
        temp_allocator: limit(),
        result_allocator: limit(),
        file_format: ufbx::FileFormat::Fbx,
        ignore_geometry: true,
        ignore_embedded: true,
        load_external_files: false,
        open_file_cb: OpenFileCb::Ref(&nothing_beside),
        progress_cb: ProgressCb::Ref(&in_time),
        progress_interval_hint: LOOK_EVERY,
        ..LoadOpts::default()
    };
    ufbx::load_memory(bytes, options).map_err(|error| FbxError::Ufbx {
        reason: error.description.to_lowercase(),
    })
}

fn settings(scene: &ufbx::Scene) -> Settings {
    let properties = &scene.settings.props;
    Settings::of(
        |name| Some(ufbx::find_prop(properties, name)?.value_int),
        |name| Some(ufbx::find_prop(properties, name)?.value_vec4.x),
        scene.metadata.ktime_second as f64,
    )
}

/// All nodes except ufbx's own root, depth first, and ufbx's indices of them.
fn tree(scene: &ufbx::Scene) -> (Vec<Node>, Vec<usize>) {
    let (mut nodes, mut ids) = (Vec::new(), Vec::new());
    let children = |node: &ufbx::Node, parent| -> Vec<(usize, Option<usize>)> {
        let children = (&node.children).into_iter();
        let mut open: Vec<_> = children.map(|child| (id(&child.element), parent)).collect();
        open.reverse();
        open
    };
    let mut open = children(&scene.root_node, None);
    while let Some((id, parent)) = open.pop() {
        let node = &scene.nodes[id];
        open.extend(children(node, Some(nodes.len())));
        nodes.push(Node {
            name: node.element.name.to_string(),
            parent,
            is_bone: node.bone.is_some(),
            is_plain: is_plain(node),
            bone: None,
        });
        ids.push(id);
    }
    (nodes, ids)
}

fn id(element: &ufbx::Element) -> usize {
    element.typed_id as usize
}

fn is_plain(node: &ufbx::Node) -> bool {
    let mut attached = (&node.all_attribs).into_iter();
    attached.all(|element| PLAIN.contains(&element.type_))
}

/// The curves that place nodes, each with ufbx's index of its node.
fn curves(stack: &ufbx::AnimStack) -> impl Iterator<Item = (usize, &ufbx::AnimCurve)> {
    let properties = (&stack.layers)
        .into_iter()
        .flat_map(|layer| &layer.anim_props);
    let placing = properties.filter(|property| {
        let is_node = property.element.type_ == ElementType::Node;
        is_node && Property::named(property.prop_name.as_bytes()).is_some()
    });
    placing.flat_map(|property| {
        let curves = property.anim_value.curves.iter().flatten();
        curves.map(|curve| (id(&property.element), &**curve))
    })
}

/// How many keys of a curve are read in the time of one look-up. Chosen.
const KEYS_PER_LOOKUP: usize = 64;

/// Look-ups that a take needs to place the nodes once: layers × nodes, and the properties that are driven.
fn lookups(stack: &ufbx::AnimStack, nodes: usize) -> usize {
    let properties = (&stack.layers).into_iter().map(|l| l.anim_props.len());
    let layered = stack.layers.len().saturating_mul(nodes);
    properties.sum::<usize>().saturating_add(layered)
}

/// The take of a stack. If it needs more work than is left in `budget`, it moves nothing and says why.
fn take(
    stack: &ufbx::AnimStack,
    settings: &Settings,
    places: &[Option<usize>],
    budget: &mut usize,
) -> Take {
    let (name, layers) = (stack.element.name.to_string(), stack.layers.len());
    let channels = lookups(stack, places.len());
    // Many properties may share a curve, so its keys count for each of them.
    let keys = curves(stack).map(|(_, curve)| curve.keyframes.len() / KEYS_PER_LOOKUP);
    match budget.checked_sub(channels.saturating_add(keys.sum())) {
        Some(left) => {
            *budget = left;
            Take {
                channels,
                ..moving(stack, name, settings, places)
            }
        }
        None => Take {
            fault: Some(Box::new(
                Explanation::input(format!(
                    "its {layers} layers and their keys for {} nodes are more than can be evaluated",
                    places.len()
                ))
                .place(format!("take `{name}`"))
                .remedy("merge its layers"),
            )),
            ..Take::still(name)
        },
    }
}

/// The take of a stack, with all that it moves.
fn moving(
    stack: &ufbx::AnimStack,
    name: String,
    settings: &Settings,
    places: &[Option<usize>],
) -> Take {
    let ticks = settings.ticks;
    let keyed = curves(stack).filter_map(|(_, curve)| {
        let keys = &curve.keyframes;
        Some((keys.first()?.time, keys.last()?.time))
    });
    let keyed = keyed.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
    // ufbx has zeros where the file states no span.
    let stated = Some((stack.time_begin, stack.time_end)).filter(|(start, end)| end > start);
    let (start, end) = first_sane(&[stated, keyed]);
    let spacings = curves(stack).flat_map(|(_, curve)| {
        let pairs = curve.keyframes.windows(2);
        pairs.map(|pair| ((pair[1].time - pair[0].time) * ticks).round())
    });
    let moving = curves(stack).filter(|(_, curve)| varies(curve));
    let mut animated: Vec<usize> = moving.filter_map(|(node, _)| places[node]).collect();
    animated.sort_unstable();
    animated.dedup();
    let mut take = Take {
        start,
        end,
        fps: rate(settings.fps, spacings, ticks),
        animated,
        ..Take::still(name)
    };
    take.problems = span_problems(&take, keyed);
    take
}

/// Whether the keys differ, or a tangent leads away from them.
fn varies(curve: &ufbx::AnimCurve) -> bool {
    let keys = &curve.keyframes;
    let slopes = |key: &ufbx::Keyframe| key.left.dy != 0.0 || key.right.dy != 0.0;
    let differs = |key: &ufbx::Keyframe| key.value != keys[0].value;
    keys.len() > 1 && keys.iter().any(|key| differs(key) || slopes(key))
}

/// The bones' transforms in every bind pose of the file.
fn binds(scene: &ufbx::Scene, nodes: &[Node], places: &[Option<usize>]) -> Vec<Binds> {
    let poses = (&scene.poses).into_iter().filter(|pose| pose.is_bind_pose);
    let bind = |bone: &ufbx::BonePose| {
        let place = places[id(&bone.bone_node.element)]?;
        let m = &bone.bone_to_world;
        #[rustfmt::skip]
        let matrix = Matrix4::new(
            m.m00, m.m01, m.m02, m.m03,
            m.m10, m.m11, m.m12, m.m13,
            m.m20, m.m21, m.m22, m.m23,
            0.0, 0.0, 0.0, 1.0,
        );
        let usable = matrix.iter().all(|&x| in_range(x));
        (nodes[place].is_bone && usable).then_some((place, matrix))
    };
    poses
        .map(|pose| pose.bone_poses.iter().filter_map(bind).collect())
        .collect()
}

/// A node's transform in its parent.
fn local(transform: &ufbx::Transform) -> Local {
    let vector = |v: &ufbx::Vec3| Vector3::new(v.x, v.y, v.z);
    let turn = &transform.rotation;
    let turn = Quaternion::new(turn.w, turn.x, turn.y, turn.z);
    let rotation = UnitQuaternion::try_new(turn, 1e-12);
    Local {
        translation: vector(&transform.translation),
        rotation: rotation.map_or_else(Matrix3::identity, |turn| {
            *turn.to_rotation_matrix().matrix()
        }),
        scale: vector(&transform.scale),
    }
}

fn inherit(node: &ufbx::Node) -> Inherit {
    match node.inherit_mode {
        ufbx::InheritMode::Normal => Inherit::RSrs,
        ufbx::InheritMode::IgnoreParentScale => Inherit::Rrs,
        ufbx::InheritMode::ComponentwiseScale => Inherit::RrSs,
    }
}

impl Scene for UfbxScene {
    fn contents(&self) -> &Contents {
        &self.contents
    }

    /// Times are taken to the nearest tick of the file's clock, so that a frame meets its keys exactly.
    fn placed(&self, at: Option<(usize, f64)>) -> Vec<Matrix4<f64>> {
        let ticks = self.ticks;
        // A take that costs too much is never evaluated.
        let usable = |take: usize| {
            self.contents
                .takes
                .get(take)
                .is_some_and(|t| t.fault.is_none())
        };
        let moment = at.filter(|&(take, _)| usable(take));
        let moment = moment.map(|(take, time)| {
            let anim = &self.scene.anim_stacks[take].anim;
            (anim, (time * ticks).round() / ticks)
        });
        // ufbx evaluates the transforms in the parents; scale inheritance is composed as for our own reader.
        let mut worlds: Vec<World> = Vec::with_capacity(self.ids.len());
        for (node, &id) in self.contents.nodes.iter().zip(&self.ids) {
            let theirs = &self.scene.nodes[id];
            let local = match moment {
                Some((anim, time)) => local(&ufbx::evaluate_transform(anim, theirs, time)),
                None => local(&theirs.local_transform),
            };
            let parent = node
                .parent
                .map_or_else(World::root, |parent| worlds[parent]);
            worlds.push(parent.below(&local, inherit(theirs)));
        }
        worlds.iter().map(World::matrix).collect()
    }
}
