//! Evaluates glTF animations straight from JSON and bytes, with plain 4 × 4 matrices (Y up, facing +Z).

use serde_json::Value;
use std::path::Path;

pub type Matrix = [[f64; 4]; 4];

const IDENTITY: Matrix = [
    [1., 0., 0., 0.],
    [0., 1., 0., 0.],
    [0., 0., 1., 0.],
    [0., 0., 0., 1.],
];

fn multiply(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|r| std::array::from_fn(|c| (0..4).map(|k| a[r][k] * b[k][c]).sum()))
}

/// A glTF file with 32-bit float accessors that aren't interleaved, and no sparse ones.
pub struct Reference {
    pub json: Value,
    buffers: Vec<Vec<u8>>,
}

impl Reference {
    pub fn open(path: &Path) -> Self {
        let bytes = std::fs::read(path).expect("the file opens");
        if !bytes.starts_with(b"glTF") {
            let json: Value = serde_json::from_slice(&bytes).expect("JSON");
            let beside = |buffer: &Value| {
                let uri = buffer["uri"].as_str().expect("an address");
                std::fs::read(path.with_file_name(uri)).expect("the buffer opens")
            };
            let buffers = json["buffers"]
                .as_array()
                .expect("buffers")
                .iter()
                .map(beside)
                .collect();
            return Self { json, buffers };
        }
        let word =
            |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("4 bytes")) as usize;
        let json_end = 20 + word(12);
        let bin = bytes[json_end + 8..json_end + 8 + word(json_end)].to_vec();
        let json = serde_json::from_slice(&bytes[20..json_end]).expect("JSON");
        Self {
            json,
            buffers: vec![bin],
        }
    }

    pub fn floats(&self, accessor: &Value) -> Vec<f64> {
        let about = &self.json["accessors"][index(accessor)];
        let view = &self.json["bufferViews"][index(&about["bufferView"])];
        assert_eq!(about["componentType"], 5126);
        let width = match about["type"].as_str() {
            Some("MAT4") => 16,
            Some("VEC4") => 4,
            Some("VEC3") => 3,
            _ => 1,
        };
        let start = number(&view["byteOffset"]) + number(&about["byteOffset"]);
        let bytes = &self.buffers[index(&view["buffer"])][start..];
        let count = index(&about["count"]) * width;
        bytes
            .chunks_exact(4)
            .take(count)
            .map(|b| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])))
            .collect()
    }

    pub fn take(&self, name: &str) -> &Value {
        let takes = self.json["animations"].as_array().expect("animations");
        takes
            .iter()
            .find(|take| take["name"] == name)
            .expect("the take")
    }

    /// First and last key of a take.
    pub fn span(&self, take: &Value) -> (f64, f64) {
        let samplers = take["samplers"].as_array().expect("samplers");
        let times: Vec<f64> = samplers
            .iter()
            .flat_map(|s| self.floats(&s["input"]))
            .collect();
        (
            times.iter().copied().fold(f64::MAX, f64::min),
            times.iter().copied().fold(f64::MIN, f64::max),
        )
    }

    /// Nodes that a take moves, without meshes that have no nodes below them.
    pub fn moved(&self, take: &Value) -> Vec<usize> {
        let moves = |channel: &&Value| channel["target"]["path"] != "weights";
        let channels = take["channels"].as_array().expect("channels").iter();
        let nodes = channels
            .filter(moves)
            .map(|channel| index(&channel["target"]["node"]));
        let carries = |node: &usize| {
            let about = &self.json["nodes"][*node];
            about["mesh"].is_null() || !about["children"].is_null()
        };
        nodes.filter(carries).collect()
    }

    /// World matrices of all nodes at `time` of `take`.
    pub fn world(&self, take: &Value, time: f64) -> Vec<Matrix> {
        let nodes = self.json["nodes"].as_array().expect("nodes");
        let mut parts: Vec<[Option<Vec<f64>>; 3]> = nodes
            .iter()
            .map(|node| ["translation", "rotation", "scale"].map(|key| list(&node[key])))
            .collect();
        for channel in take["channels"].as_array().expect("channels") {
            let path = match channel["target"]["path"].as_str() {
                Some("translation") => 0,
                Some("rotation") => 1,
                Some("scale") => 2,
                _ => continue,
            };
            let sampler = &take["samplers"][index(&channel["sampler"])];
            parts[index(&channel["target"]["node"])][path] =
                Some(self.value(sampler, path == 1, time));
        }
        let local: Vec<Matrix> = nodes
            .iter()
            .zip(&parts)
            .map(|(node, parts)| local(list(&node["matrix"]), parts))
            .collect();
        let parent = self.parents();
        let climb = |node: usize| {
            let mut world = local[node];
            let mut above = parent[node];
            while let Some(at) = above {
                world = multiply(&local[at], &world);
                above = parent[at];
            }
            world
        };
        (0..nodes.len()).map(climb).collect()
    }

    fn parents(&self) -> Vec<Option<usize>> {
        let nodes = self.json["nodes"].as_array().expect("nodes");
        let mut parent = vec![None; nodes.len()];
        for (at, node) in nodes.iter().enumerate() {
            for child in node["children"].as_array().into_iter().flatten() {
                parent[index(child)] = Some(at);
            }
        }
        parent
    }

    /// Names of every node and those above it.
    pub fn paths(&self) -> Vec<String> {
        let parents = self.parents();
        let name = |node: usize| self.json["nodes"][node]["name"].as_str().expect("a name");
        let path = |mut node: usize| {
            let mut path = format!("/{}", name(node));
            while let Some(parent) = parents[node] {
                node = parent;
                path = format!("/{}{path}", name(node));
            }
            path
        };
        (0..parents.len()).map(path).collect()
    }

    fn value(&self, sampler: &Value, turns: bool, time: f64) -> Vec<f64> {
        let (times, values) = (
            self.floats(&sampler["input"]),
            self.floats(&sampler["output"]),
        );
        let kind = sampler["interpolation"].as_str().unwrap_or("LINEAR");
        let blocks = if kind == "CUBICSPLINE" { 3 } else { 1 };
        let width = values.len() / times.len() / blocks;
        let block = |key: usize, block: usize| &values[(key * blocks + block) * width..][..width];
        let key_value = |key: usize| block(key, blocks / 2).to_vec();
        let last = times.len() - 1;
        if time <= times[0] || time >= times[last] {
            return key_value(if time <= times[0] { 0 } else { last });
        }
        let b = times
            .iter()
            .position(|&key| key > time)
            .expect("a later key");
        let (a, gap) = (b - 1, times[b] - times[b - 1]);
        let t = (time - times[a]) / gap;
        match kind {
            // Frames fall on keys only up to the 32 bits that key times are rounded to.
            "STEP" => key_value(if times[b] - time < 1e-6 { b } else { a }),
            "LINEAR" if turns => slerp(&key_value(a), &key_value(b), t),
            "LINEAR" => mix(&[(1. - t, &key_value(a)), (t, &key_value(b))]),
            _ => mix(&[
                (2. * t.powi(3) - 3. * t.powi(2) + 1., block(a, 1)),
                (gap * (t.powi(3) - 2. * t.powi(2) + t), block(a, 2)),
                (-2. * t.powi(3) + 3. * t.powi(2), block(b, 1)),
                (gap * (t.powi(3) - t.powi(2)), block(b, 0)),
            ]),
        }
    }
}

fn index(value: &Value) -> usize {
    usize::try_from(value.as_u64().expect("an index")).expect("an index")
}

fn number(value: &Value) -> usize {
    value
        .as_u64()
        .map_or(0, |n| usize::try_from(n).expect("a size"))
}

fn list(value: &Value) -> Option<Vec<f64>> {
    value.as_array().map(|items| {
        items
            .iter()
            .map(|x| x.as_f64().expect("a number"))
            .collect()
    })
}

fn mix(terms: &[(f64, &[f64])]) -> Vec<f64> {
    (0..terms[0].1.len())
        .map(|k| terms.iter().map(|(weight, v)| weight * v[k]).sum())
        .collect()
}

fn slerp(a: &[f64], b: &[f64], t: f64) -> Vec<f64> {
    // Keys are rounded to 32 bits; a dot product above 1 would hide small angles.
    let unit = |q: &[f64]| {
        let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
        q.iter().map(|x| x / norm).collect::<Vec<f64>>()
    };
    let (a, b) = (unit(a), unit(b));
    let dot: f64 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
    let b: Vec<f64> = b.iter().map(|x| x * dot.signum()).collect();
    let angle = dot.abs().min(1.0).acos();
    if angle < 1e-7 {
        return a;
    }
    mix(&[
        (((1. - t) * angle).sin() / angle.sin(), &a),
        ((t * angle).sin() / angle.sin(), &b),
    ])
}

/// Matrix of a node, from its own sixteen numbers (by columns) or its three parts.
fn local(
    matrix: Option<Vec<f64>>,
    [translation, rotation, scale]: &[Option<Vec<f64>>; 3],
) -> Matrix {
    if let Some(m) = matrix {
        return std::array::from_fn(|r| std::array::from_fn(|c| m[4 * c + r]));
    }
    let mut local = IDENTITY;
    if let Some(q) = rotation {
        let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
        let [x, y, z, w] = [0, 1, 2, 3].map(|k| q[k] / norm);
        local[0][..3].copy_from_slice(&[
            1. - 2. * (y * y + z * z),
            2. * (x * y - w * z),
            2. * (x * z + w * y),
        ]);
        local[1][..3].copy_from_slice(&[
            2. * (x * y + w * z),
            1. - 2. * (x * x + z * z),
            2. * (y * z - w * x),
        ]);
        local[2][..3].copy_from_slice(&[
            2. * (x * z - w * y),
            2. * (y * z + w * x),
            1. - 2. * (x * x + y * y),
        ]);
    }
    for row in 0..3 {
        for column in 0..3 {
            local[row][column] *= scale.as_ref().map_or(1.0, |s| s[column]);
        }
        local[row][3] = translation.as_ref().map_or(0.0, |t| t[row]);
    }
    local
}
