//! An FBX 7.4 binary document: a skeleton of limb nodes and one take that moves it. Centimetres, Y up, facing +Z.

use crate::fbx_tree::{
    CREATION_TIME, FILE_ID, Node, Value, bytes, group, leaf, node, property, text,
};
use crate::rig::{HIPS, JOINTS, NAMES, Pose, Quat, Rig, V3};
use Value::{Double, Flag, Floats, Int, Ints, Long, Longs};
use fbxcel::writer::v7400::binary::Result;

/// FBX ticks per second.
const TICKS: i64 = 46_186_158_000;
const CM: f64 = 100.0;
const CREATOR: &str = "mimic author_clips";
/// FBX's number for 60 frames per second.
const TIME_MODE_60: i32 = 3;
pub const FPS: i64 = 60;

const DOCUMENT: i64 = 1;
const STACK: i64 = 2;
const LAYER: i64 = 3;
const MODELS: i64 = 1000;
const ATTRIBUTES: i64 = 2000;
const CURVE_NODES: i64 = 3000;
const CURVES: i64 = 10_000;

/// Three curves on one vector property of a joint.
struct Channel {
    joint: usize,
    property: &'static str,
    /// `T` or `R`.
    short: &'static str,
    /// Per axis, per frame; cm or degrees.
    values: [Vec<f64>; 3],
}

/// The file of `poses` at [`FPS`], with a take named `take`.
pub fn document(rig: &Rig, poses: &[Pose], take: &str) -> Result<Vec<u8>> {
    let channels = channels(rig, poses);
    let end = TICKS / FPS * (poses.len() as i64 - 1);
    bytes(&[
        header(),
        leaf("FileId", Value::Bytes(FILE_ID.to_vec())),
        leaf("CreationTime", text(CREATION_TIME)),
        leaf("Creator", text(CREATOR)),
        global_settings(end),
        documents(take),
        group("References", Vec::new()),
        definitions(channels.len() as i32),
        group("Objects", objects(rig, &channels, take, end)),
        group("Connections", connections(&channels)),
        takes(take, end),
    ])
}

fn header() -> Node {
    let clock = [
        ("Year", 1970),
        ("Month", 1),
        ("Day", 1),
        ("Hour", 10),
        ("Minute", 0),
        ("Second", 0),
    ];
    let mut stamp = vec![leaf("Version", Int(1000))];
    stamp.extend(clock.map(|(name, v)| leaf(name, Int(v))));
    stamp.push(leaf("Millisecond", Int(0)));
    let children = vec![
        leaf("FBXHeaderVersion", Int(1003)),
        leaf("FBXVersion", Int(7400)),
        leaf("EncryptionType", Int(0)),
        group("CreationTimeStamp", stamp),
        leaf("Creator", text(CREATOR)),
    ];
    group("FBXHeaderExtension", children)
}

fn global_settings(end: i64) -> Node {
    let int = |name: &str, v: i32| property([name, "int", "Integer", ""], vec![Int(v)]);
    let number = |name: &str, v: f64| property([name, "double", "Number", ""], vec![Double(v)]);
    let time = |name: &str, v: i64| property([name, "KTime", "Time", ""], vec![Long(v)]);
    let properties = vec![
        int("UpAxis", 1),
        int("UpAxisSign", 1),
        int("FrontAxis", 2),
        int("FrontAxisSign", 1),
        int("CoordAxis", 0),
        int("CoordAxisSign", 1),
        int("OriginalUpAxis", 1),
        int("OriginalUpAxisSign", 1),
        number("UnitScaleFactor", 1.0),
        number("OriginalUnitScaleFactor", 1.0),
        property(["TimeMode", "enum", "", ""], vec![Int(TIME_MODE_60)]),
        time("TimeSpanStart", 0),
        time("TimeSpanStop", end),
        number("CustomFrameRate", -1.0),
    ];
    let children = vec![
        leaf("Version", Int(1000)),
        group("Properties70", properties),
    ];
    group("GlobalSettings", children)
}

fn documents(take: &str) -> Node {
    let active = property(["ActiveAnimStackName", "KString", "", ""], vec![text(take)]);
    let document = node(
        "Document",
        vec![Long(DOCUMENT), text(""), text("Scene")],
        vec![
            group("Properties70", vec![active]),
            leaf("RootNode", Long(0)),
        ],
    );
    group("Documents", vec![leaf("Count", Int(1)), document])
}

fn definitions(channels: i32) -> Node {
    let joints = JOINTS as i32;
    let kinds = [
        ("GlobalSettings", 1),
        ("Model", joints),
        ("NodeAttribute", joints),
        ("AnimationStack", 1),
        ("AnimationLayer", 1),
        ("AnimationCurveNode", channels),
        ("AnimationCurve", 3 * channels),
    ];
    let total = kinds.iter().map(|(_, n)| n).sum();
    let mut children = vec![leaf("Version", Int(100)), leaf("Count", Int(total))];
    children.extend(
        kinds.map(|(name, n)| node("ObjectType", vec![text(name)], vec![leaf("Count", Int(n))])),
    );
    group("Definitions", children)
}

/// Id, name and class, as every object begins.
fn title(id: i64, name: &str, class: &str, kind: &str) -> Vec<Value> {
    vec![
        Long(id),
        Value::Text(format!("{name}\0\u{1}{class}")),
        text(kind),
    ]
}

fn objects(rig: &Rig, channels: &[Channel], take: &str, end: i64) -> Vec<Node> {
    let mut all: Vec<Node> = (0..JOINTS).map(attribute).collect();
    all.extend((0..JOINTS).map(|joint| model(rig, joint)));
    let time = |name: &str, v: i64| property([name, "KTime", "Time", ""], vec![Long(v)]);
    let span = vec![
        time("LocalStart", 0),
        time("LocalStop", end),
        time("ReferenceStart", 0),
        time("ReferenceStop", end),
    ];
    all.push(node(
        "AnimationStack",
        title(STACK, take, "AnimStack", ""),
        vec![group("Properties70", span)],
    ));
    all.push(node(
        "AnimationLayer",
        title(LAYER, "BaseLayer", "AnimLayer", ""),
        Vec::new(),
    ));
    for (c, channel) in channels.iter().enumerate() {
        all.push(curve_node(c, channel));
        all.extend(
            channel
                .values
                .iter()
                .enumerate()
                .map(|(axis, values)| curve(curve_id(c, axis), values)),
        );
    }
    all
}

fn attribute(joint: usize) -> Node {
    let title = title(
        ATTRIBUTES + joint as i64,
        NAMES[joint],
        "NodeAttribute",
        "LimbNode",
    );
    let size = property(["Size", "double", "Number", ""], vec![Double(10.0)]);
    let children = vec![
        group("Properties70", vec![size]),
        leaf("TypeFlags", text("Skeleton")),
    ];
    node("NodeAttribute", title, children)
}

/// Values that other machines' rounding cannot change.
fn settled(v: V3) -> Vec<Value> {
    v.iter().map(|x| Double((x * 1e9).round() * 1e-9)).collect()
}

fn model(rig: &Rig, joint: usize) -> Node {
    let rest = rig.rest_local(joint);
    let properties = vec![
        property(["RotationActive", "bool", "", ""], vec![Int(1)]),
        property(["InheritType", "enum", "", ""], vec![Int(1)]),
        property(
            ["PreRotation", "Vector3D", "Vector", ""],
            settled(euler(&pre_rotation(rig, joint))),
        ),
        property(
            ["DefaultAttributeIndex", "int", "Integer", ""],
            vec![Int(0)],
        ),
        property(
            ["Lcl Translation", "Lcl Translation", "", "A"],
            settled(rest.translation.vector * CM),
        ),
        property(
            ["Lcl Rotation", "Lcl Rotation", "", "A"],
            settled(V3::zeros()),
        ),
        property(
            ["Lcl Scaling", "Lcl Scaling", "", "A"],
            settled(V3::repeat(1.0)),
        ),
    ];
    let children = vec![
        leaf("Version", Int(232)),
        group("Properties70", properties),
        leaf("Shading", Flag(true)),
        leaf("Culling", text("CullingOff")),
    ];
    node(
        "Model",
        title(MODELS + joint as i64, NAMES[joint], "Model", "LimbNode"),
        children,
    )
}

fn curve_id(channel: usize, axis: usize) -> i64 {
    CURVES + (3 * channel + axis) as i64
}

fn curve_node(c: usize, channel: &Channel) -> Node {
    let axes = ["d|X", "d|Y", "d|Z"].into_iter().zip(&channel.values);
    let first = |v: &[f64]| Double(f64::from(v[0] as f32));
    let properties = axes.map(|(name, v)| property([name, "Number", "", "A"], vec![first(v)]));
    let title = title(CURVE_NODES + c as i64, channel.short, "AnimCurveNode", "");
    node(
        "AnimationCurveNode",
        title,
        vec![group("Properties70", properties.collect())],
    )
}

/// A key at every frame, straight lines between them.
fn curve(id: i64, values: &[f64]) -> Node {
    const LINEAR: i32 = 4;
    let times = (0..values.len() as i64)
        .map(|k| k * (TICKS / FPS))
        .collect();
    let keys = values.iter().map(|v| *v as f32).collect();
    let children = vec![
        leaf("Default", Double(0.0)),
        leaf("KeyVer", Int(4008)),
        leaf("KeyTime", Longs(times)),
        leaf("KeyValueFloat", Floats(keys)),
        leaf("KeyAttrFlags", Ints(vec![LINEAR])),
        leaf("KeyAttrDataFloat", Floats(vec![0.0; 4])),
        leaf("KeyAttrRefCount", Ints(vec![values.len() as i32])),
    ];
    node("AnimationCurve", title(id, "", "AnimCurve", ""), children)
}

fn connections(channels: &[Channel]) -> Vec<Node> {
    let link = |from: i64, to: i64| node("C", vec![text("OO"), Long(from), Long(to)], Vec::new());
    let plug = |from: i64, to: i64, at: &str| {
        node(
            "C",
            vec![text("OP"), Long(from), Long(to), text(at)],
            Vec::new(),
        )
    };
    let mut all = Vec::new();
    for joint in 0..JOINTS {
        let parent = Rig::parent(joint).map_or(0, |p| MODELS + p as i64);
        all.push(link(MODELS + joint as i64, parent));
        all.push(link(ATTRIBUTES + joint as i64, MODELS + joint as i64));
    }
    all.push(link(LAYER, STACK));
    for (c, channel) in channels.iter().enumerate() {
        let id = CURVE_NODES + c as i64;
        all.push(link(id, LAYER));
        all.push(plug(id, MODELS + channel.joint as i64, channel.property));
        for (axis, at) in ["d|X", "d|Y", "d|Z"].into_iter().enumerate() {
            all.push(plug(curve_id(c, axis), id, at));
        }
    }
    all
}

fn takes(take: &str, end: i64) -> Node {
    let span = |name| node(name, vec![Long(0), Long(end)], Vec::new());
    let children = vec![
        leaf("FileName", Value::Text(format!("{take}.tak"))),
        span("LocalTime"),
        span("ReferenceTime"),
    ];
    let body = node("Take", vec![text(take)], children);
    group("Takes", vec![leaf("Current", text(take)), body])
}

fn pre_rotation(rig: &Rig, joint: usize) -> Quat {
    rig.rest_local(joint).rotation
}

fn channels(rig: &Rig, poses: &[Pose]) -> Vec<Channel> {
    let locals: Vec<_> = poses.iter().map(|p| p.local(rig)).collect();
    let travel: Vec<V3> = locals
        .iter()
        .map(|l| l[HIPS].translation.vector * CM)
        .collect();
    let mut all = vec![channel(HIPS, "Lcl Translation", "T", &travel)];
    // The last joint only marks the top of the head.
    for joint in 0..JOINTS - 1 {
        let back = pre_rotation(rig, joint).inverse();
        let turns: Vec<Quat> = locals.iter().map(|l| back * l[joint].rotation).collect();
        all.push(channel(joint, "Lcl Rotation", "R", &continuous(&turns)));
    }
    all
}

fn channel(joint: usize, property: &'static str, short: &'static str, values: &[V3]) -> Channel {
    Channel {
        joint,
        property,
        short,
        values: [0, 1, 2].map(|i| values.iter().map(|v| v[i]).collect()),
    }
}

/// Degrees about x, y, z for FBX's order XYZ: the matrix is Rz Ry Rx.
fn euler(turn: &Quat) -> V3 {
    let (x, y, z) = turn.euler_angles();
    V3::new(x, y, z).map(f64::to_degrees)
}

/// Euler angles without jumps: of the two triples that mean the same turn, and their whole turns, the nearest to the
/// frame before.
fn continuous(turns: &[Quat]) -> Vec<V3> {
    let mut last = V3::zeros();
    let mut next = |turn: &Quat| {
        let e = euler(turn);
        let twin = V3::new(e.x + 180.0, 180.0 - e.y, e.z + 180.0);
        let near = |v: V3| v.zip_map(&last, |a, b| a - 360.0 * ((a - b) / 360.0).round());
        let (one, other) = (near(e), near(twin));
        last = if (other - last).norm() < (one - last).norm() {
            other
        } else {
            one
        };
        last
    };
    turns.iter().map(&mut next).collect()
}
