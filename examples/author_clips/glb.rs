//! A binary glTF 2.0 file: the rig, a simple body of boxes skinned to it, and one animation. Metres, Y up, facing +Z.

use crate::rig::{
    CHEST, HAND, HEAD, HEAD_TOP, HIPS, JOINTS, NAMES, NECK, Pose, Rig, SHOULDER, SPINE, TOES,
    UP_LEG, V3, side_sign,
};
use nalgebra::Isometry3;
use serde_json::{Value, json};

const FLOAT: u32 = 5126;
const UNSIGNED_BYTE: u32 = 5121;
const UNSIGNED_SHORT: u32 = 5123;

/// The binary chunk with its views and accessors.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    /// Adds an accessor of its own view; `extra` holds what else its JSON needs.
    fn add(
        &mut self,
        bytes: &[u8],
        component: u32,
        kind: &str,
        count: usize,
        extra: Value,
    ) -> usize {
        let view = json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()});
        self.bytes.extend(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut accessor = json!({
            "bufferView": self.views.len(), "componentType": component, "type": kind, "count": count,
        });
        for (key, value) in extra.as_object().into_iter().flatten() {
            accessor[key] = value.clone();
        }
        self.views.push(view);
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn floats<const N: usize>(&mut self, kind: &str, rows: &[[f32; N]], extra: Value) -> usize {
        let bytes: Vec<u8> = rows
            .iter()
            .flatten()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        self.add(&bytes, FLOAT, kind, rows.len(), extra)
    }
}

/// The file of `poses`, `fps` a second, with one animation.
pub fn document(rig: &Rig, poses: &[Pose], fps: f64, name: &str) -> Vec<u8> {
    let mut buffer = Buffer::default();
    let mesh = mesh(rig, &mut buffer);
    let inverse_bind = inverse_bind(rig, &mut buffer);
    let animation = animation(rig, poses, fps, name, &mut buffer);
    let mut nodes: Vec<Value> = (0..JOINTS).map(|joint| joint_node(rig, joint)).collect();
    nodes.push(json!({"name": "Body", "mesh": 0, "skin": 0}));
    let joints: Vec<usize> = (0..JOINTS).collect();
    let root = json!({
        "asset": {"version": "2.0", "generator": "mimic author_clips"},
        "scene": 0,
        "scenes": [{"name": "Scene", "nodes": [HIPS, JOINTS]}],
        "nodes": nodes,
        "meshes": [mesh],
        "skins": [{"joints": joints, "skeleton": HIPS, "inverseBindMatrices": inverse_bind}],
        "animations": [animation],
        "materials": [{
            "name": "Body",
            "pbrMetallicRoughness": {"baseColorFactor": [0.55, 0.6, 0.68, 1.0], "metallicFactor": 0.0},
        }],
        "buffers": [{"byteLength": buffer.bytes.len()}],
        "bufferViews": buffer.views,
        "accessors": buffer.accessors,
    });
    container(&root.to_string(), &buffer.bytes)
}

fn container(json: &str, binary: &[u8]) -> Vec<u8> {
    let mut text = json.as_bytes().to_vec();
    text.resize(text.len().next_multiple_of(4), b' ');
    let total = 12 + 8 + text.len() + 8 + binary.len();
    let mut out = b"glTF".to_vec();
    out.extend(2u32.to_le_bytes());
    out.extend((total as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", text.as_slice()), (b"BIN\0", binary)] {
        out.extend((chunk.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(chunk);
    }
    out
}

fn vec3(v: V3) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

/// x, y, z, w.
fn quaternion(at: &Isometry3<f64>) -> [f32; 4] {
    let q = at.rotation.coords;
    [q.x as f32, q.y as f32, q.z as f32, q.w as f32]
}

fn joint_node(rig: &Rig, joint: usize) -> Value {
    let rest = rig.rest_local(joint);
    let mut node = json!({
        "name": NAMES[joint],
        "translation": vec3(rest.translation.vector),
        "rotation": quaternion(&rest),
    });
    let children: Vec<usize> = (0..JOINTS)
        .filter(|&j| Rig::parent(j) == Some(joint))
        .collect();
    if !children.is_empty() {
        node["children"] = json!(children);
    }
    node
}

fn inverse_bind(rig: &Rig, buffer: &mut Buffer) -> usize {
    let matrix = |joint: usize| -> [f32; 16] {
        let m = rig.rest_world(joint).inverse().to_homogeneous();
        std::array::from_fn(|i| m.as_slice()[i] as f32)
    };
    let rows: Vec<[f32; 16]> = (0..JOINTS).map(matrix).collect();
    buffer.floats("MAT4", &rows, json!({}))
}

fn animation(rig: &Rig, poses: &[Pose], fps: f64, name: &str, buffer: &mut Buffer) -> Value {
    let locals: Vec<_> = poses.iter().map(|p| p.local(rig)).collect();
    let times: Vec<[f32; 1]> = (0..poses.len())
        .map(|k| [(k as f64 / fps) as f32])
        .collect();
    let span = json!({"min": times[0], "max": times[times.len() - 1]});
    let input = buffer.floats("SCALAR", &times, span);
    let travel: Vec<[f32; 3]> = locals
        .iter()
        .map(|l| vec3(l[HIPS].translation.vector))
        .collect();
    let mut tracks = vec![(
        HIPS,
        "translation",
        buffer.floats("VEC3", &travel, json!({})),
    )];
    // The last joint only marks the top of the head.
    for joint in 0..JOINTS - 1 {
        let turns: Vec<_> = locals.iter().map(|l| quaternion(&l[joint])).collect();
        tracks.push((
            joint,
            "rotation",
            buffer.floats("VEC4", &one_hemisphere(turns), json!({})),
        ));
    }
    let sampler = |(_, _, output): &(usize, &str, usize)| json!({"input": input, "output": output, "interpolation": "LINEAR"});
    let channel = |(k, (node, path, _)): (usize, &(usize, &str, usize))| json!({"sampler": k, "target": {"node": node, "path": path}});
    json!({
        "name": name,
        "samplers": tracks.iter().map(sampler).collect::<Vec<_>>(),
        "channels": tracks.iter().enumerate().map(channel).collect::<Vec<_>>(),
    })
}

/// Of q and −q, the one nearer to the frame before.
fn one_hemisphere(mut turns: Vec<[f32; 4]>) -> Vec<[f32; 4]> {
    for k in 1..turns.len() {
        let dot: f32 = turns[k].iter().zip(&turns[k - 1]).map(|(a, b)| a * b).sum();
        if dot < 0.0 {
            turns[k] = turns[k].map(|v| -v);
        }
    }
    turns
}

/// A box fixed to a joint, world axes at rest, from the joint, m.
struct Block {
    joint: usize,
    low: V3,
    high: V3,
}

/// From a joint along `bone`, as thick as `half` to every side across.
fn along(joint: usize, bone: V3, half: [f64; 3]) -> Block {
    let main = bone.iamax();
    let pad = V3::from_fn(|i, _| if i == main { 0.0 } else { half[i] });
    Block {
        joint,
        low: V3::zeros().inf(&bone) - pad,
        high: V3::zeros().sup(&bone) + pad,
    }
}

fn blocks(rig: &Rig) -> Vec<Block> {
    let to = |a: usize, b: usize| rig.offset(a, b);
    let mut all = vec![
        Block {
            joint: HIPS,
            low: V3::new(-0.15, -0.09, -0.10),
            high: V3::new(0.15, 0.08, 0.09),
        },
        along(SPINE, to(SPINE, CHEST), [0.13, 0.0, 0.085]),
        along(CHEST, to(CHEST, NECK) * 0.95, [0.155, 0.0, 0.10]),
        along(NECK, to(NECK, HEAD), [0.05, 0.0, 0.04]),
        along(HEAD, to(HEAD, HEAD_TOP), [0.075, 0.0, 0.09]),
    ];
    for side in 0..2 {
        let (arm, leg) = (SHOULDER[side] + 1, UP_LEG[side]);
        let toes = V3::new(0.0, 0.0, TOES);
        let outward = V3::x() * side_sign(side) * HAND;
        all.extend([
            along(arm, to(arm, arm + 1), [0.0, 0.045, 0.045]),
            along(arm + 1, to(arm + 1, arm + 2), [0.0, 0.036, 0.036]),
            along(arm + 2, outward, [0.0, 0.018, 0.042]),
            along(leg, to(leg, leg + 1), [0.07, 0.0, 0.075]),
            along(leg + 1, to(leg + 1, leg + 2), [0.05, 0.0, 0.055]),
            Block {
                joint: leg + 2,
                low: V3::new(-0.04, -0.065, -0.055),
                high: V3::new(0.04, 0.01, 0.135),
            },
            along(leg + 3, toes, [0.042, 0.019, 0.0]),
        ]);
    }
    all
}

/// Vertices of all boxes, six faces of four each.
#[derive(Default)]
struct Mesh {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    joints: Vec<u8>,
    indices: Vec<u16>,
}

impl Mesh {
    fn block(&mut self, rig: &Rig, block: &Block) {
        for face in 0..6 {
            let (axis, outward) = (face % 3, face < 3);
            let first = self.positions.len() as u16;
            let mut normal = [0.0; 3];
            normal[axis] = if outward { 1.0 } else { -1.0 };
            for corner in 0..4 {
                // Counter-clockwise seen along +axis; the opposite face runs the other way.
                let turn = if outward { corner } else { 3 - corner };
                let high = [(1..3).contains(&turn), turn >= 2];
                let mut pick = [outward; 3];
                (pick[(axis + 1) % 3], pick[(axis + 2) % 3]) = (high[0], high[1]);
                let at = V3::from_fn(|i, _| if pick[i] { block.high[i] } else { block.low[i] });
                self.positions.push(vec3(rig.rest[block.joint] + at));
                self.normals.push(normal);
                self.joints.extend([block.joint as u8, 0, 0, 0]);
            }
            self.indices.extend([0, 1, 2, 0, 2, 3].map(|k| first + k));
        }
    }
}

fn mesh(rig: &Rig, buffer: &mut Buffer) -> Value {
    let mut mesh = Mesh::default();
    for block in blocks(rig) {
        mesh.block(rig, &block);
    }
    let count = mesh.positions.len();
    let bound = |pick: fn(f32, f32) -> f32| -> Vec<f32> {
        let axis = |i: usize| {
            mesh.positions
                .iter()
                .map(|p| p[i])
                .reduce(pick)
                .unwrap_or_default()
        };
        [0, 1, 2].map(axis).to_vec()
    };
    let bounds = json!({"min": bound(f32::min), "max": bound(f32::max)});
    let weights = vec![[1.0f32, 0.0, 0.0, 0.0]; count];
    let indices: Vec<u8> = mesh.indices.iter().flat_map(|i| i.to_le_bytes()).collect();
    json!({
        "name": "Body",
        "primitives": [{
            "attributes": {
                "POSITION": buffer.floats("VEC3", &mesh.positions, bounds),
                "NORMAL": buffer.floats("VEC3", &mesh.normals, json!({})),
                "JOINTS_0": buffer.add(&mesh.joints, UNSIGNED_BYTE, "VEC4", count, json!({})),
                "WEIGHTS_0": buffer.floats("VEC4", &weights, json!({})),
            },
            "indices": buffer.add(&indices, UNSIGNED_SHORT, "SCALAR", mesh.indices.len(), json!({})),
            "material": 0,
        }],
    })
}
