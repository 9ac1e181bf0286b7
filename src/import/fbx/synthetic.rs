//! Random small scenes, written by `fbxcel`, that use every feature of nodes, layers and curves at once.

use super::against_ufbx::compare_bytes;
use fbxcel::low::FbxVersion;
use fbxcel::low::v7400::ArrayAttributeEncoding;
use fbxcel::writer::v7400::binary::Writer;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::io::Cursor;

const SECOND: i64 = 46_186_158_000;
const PROPERTIES: [(&str, f64); 9] = [
    ("Lcl Translation", 50.0),
    ("Lcl Rotation", 170.0),
    ("Lcl Scaling", 2.0),
    ("PreRotation", 170.0),
    ("PostRotation", 170.0),
    ("RotationOffset", 10.0),
    ("RotationPivot", 10.0),
    ("ScalingOffset", 10.0),
    ("ScalingPivot", 10.0),
];

enum Value<'a> {
    Int(i64),
    Real(f64),
    Text(&'a str),
    Longs(Vec<i64>),
    Ints(Vec<i32>),
    Reals(Vec<f32>),
}
use Value::{Int, Ints, Longs, Real, Reals, Text};

struct Author {
    writer: Writer<Cursor<Vec<u8>>>,
    random: ChaCha8Rng,
    connections: Vec<(&'static str, i64, i64, String)>,
    last_id: i64,
}

/// Bytes of the scene number `seed`.
pub(super) fn scene(seed: u64) -> Vec<u8> {
    let version = if seed.is_multiple_of(2) {
        FbxVersion::V7_4
    } else {
        FbxVersion::V7_5
    };
    let mut author = Author {
        writer: Writer::new(Cursor::new(Vec::new()), version).expect("a known version"),
        random: ChaCha8Rng::seed_from_u64(seed),
        connections: Vec::new(),
        last_id: 0,
    };
    let count = if seed.is_multiple_of(3) { 1 } else { 5 };
    author.node("Objects", vec![], |author| {
        let models: Vec<i64> = (0..count).map(|_| author.model()).collect();
        for pair in models.windows(2) {
            author
                .connections
                .push(("OO", pair[1], pair[0], String::new()));
        }
        author.take(&models);
    });
    author.node("Connections", vec![], |author| {
        for (kind, child, parent, property) in std::mem::take(&mut author.connections) {
            let values = vec![Text(kind), Int(child), Int(parent), Text(&property)];
            author.node("C", values, |_| {});
        }
    });
    author
        .writer
        .finalize(&Default::default())
        .expect("memory takes all")
        .into_inner()
}

impl Author {
    fn node(&mut self, name: &str, values: Vec<Value>, children: impl FnOnce(&mut Self)) {
        let mut attributes = self.writer.new_node(name).expect("memory takes all");
        let zlib = Some(ArrayAttributeEncoding::Zlib);
        for value in values {
            match value {
                Int(value) => attributes.append_i64(value),
                Real(value) => attributes.append_f64(value),
                Text(text) => attributes.append_string_direct(text),
                Longs(values) => attributes.append_arr_i64_from_iter(zlib, values),
                Ints(values) => attributes.append_arr_i32_from_iter(None, values),
                Reals(values) => attributes.append_arr_f32_from_iter(zlib, values),
            }
            .expect("memory takes all");
        }
        children(self);
        self.writer.close_node().expect("a node is open");
    }

    /// Uniform in 0..count.
    fn pick(&mut self, count: u32) -> u32 {
        self.random.next_u32() % count
    }

    /// Uniform in -size..size.
    fn real(&mut self, size: f64) -> f64 {
        (f64::from(self.random.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0) * size
    }

    fn value(&mut self, property: &str, size: f64) -> f64 {
        let value = self.real(size);
        if property == "Lcl Scaling" {
            value.abs() + 0.2
        } else {
            value
        }
    }

    fn object(
        &mut self,
        class: &str,
        name: &str,
        kind: &str,
        children: impl FnOnce(&mut Self),
    ) -> i64 {
        self.last_id += 1;
        let id = self.last_id;
        let full = format!("{name}{id}\0\x01{class}");
        self.node(class, vec![Int(id), Text(&full), Text(kind)], children);
        id
    }

    fn property(&mut self, name: &str, values: &[f64]) {
        let mut all = vec![Text(name), Text("Number"), Text(""), Text("A")];
        all.extend(values.iter().map(|&value| Real(value)));
        self.node("P", all, |_| {});
    }

    fn number(&mut self, name: &str, value: u32) {
        self.property(name, &[f64::from(value)]);
    }

    fn model(&mut self) -> i64 {
        self.object("Model", "bone", "LimbNode", |author| {
            author.node("Properties70", vec![], |author| {
                for (name, size) in PROPERTIES {
                    let vector = [(); 3].map(|()| author.value(name, size));
                    author.property(name, &vector);
                }
                for (name, count) in [
                    ("RotationOrder", 6),
                    ("InheritType", 3),
                    ("RotationActive", 2),
                ] {
                    let value = author.pick(count);
                    author.number(name, value);
                }
            });
        })
    }

    fn take(&mut self, models: &[i64]) {
        let stack = self.object("AnimationStack", "take", "", |author| {
            author.node("Properties70", vec![], |author| {
                author.node(
                    "P",
                    vec![
                        Text("LocalStart"),
                        Text("KTime"),
                        Text("Time"),
                        Text(""),
                        Int(0),
                    ],
                    |_| {},
                );
                author.node(
                    "P",
                    vec![
                        Text("LocalStop"),
                        Text("KTime"),
                        Text("Time"),
                        Text(""),
                        Int(SECOND),
                    ],
                    |_| {},
                );
            });
        });
        // ufbx 0.23.1 lets a layer that drives other properties of a node fall through to the next node's channels.
        let some_miss = models.len() == 1;
        let driven: Vec<Vec<_>> = models
            .iter()
            .map(|_| {
                PROPERTIES
                    .into_iter()
                    .filter(|_| self.pick(3) == 0)
                    .collect()
            })
            .collect();
        for _ in 0..1 + self.pick(4) {
            let layer = self.object("AnimationLayer", "layer", "", |author| {
                author.node("Properties70", vec![], |author| {
                    for (name, count) in [
                        ("Weight", 101),
                        ("BlendMode", 3),
                        ("RotationAccumulationMode", 2),
                        ("ScaleAccumulationMode", 2),
                    ] {
                        let value = author.pick(count);
                        author.number(name, value);
                    }
                });
            });
            self.connections.push(("OO", layer, stack, String::new()));
            for (&model, driven) in models.iter().zip(&driven) {
                for &(name, size) in driven {
                    if !some_miss || self.pick(3) > 0 {
                        self.channel(layer, model, name, size);
                    }
                }
            }
        }
    }

    fn channel(&mut self, layer: i64, model: i64, name: &str, size: f64) {
        let curve_node = self.object("AnimationCurveNode", "channel", "", |author| {
            author.node("Properties70", vec![], |author| {
                for axis in ["d|X", "d|Y", "d|Z"] {
                    let value = author.value(name, size);
                    author.property(axis, &[value]);
                }
            });
        });
        self.connections
            .push(("OO", curve_node, layer, String::new()));
        self.connections
            .push(("OP", curve_node, model, name.to_owned()));
        for axis in ["d|X", "d|Y", "d|Z"] {
            if self.pick(4) > 0 {
                let curve = self.curve(name, size);
                self.connections
                    .push(("OP", curve, curve_node, axis.to_owned()));
            }
        }
    }

    fn curve(&mut self, name: &str, size: f64) -> i64 {
        let count = 1 + self.pick(7) as usize;
        let times = (0..count as i64)
            .map(|i| i * SECOND / 6 + i64::from(self.pick(1 << 30)) + SECOND / 10)
            .collect();
        let values = (0..count).map(|_| self.value(name, size) as f32).collect();
        let attributes: Vec<(i32, [f32; 4])> = (0..count).map(|_| self.attribute()).collect();
        // On angles and scales, slopes that go on would multiply the rounding of ufbx's f32 tangents.
        let kinds: &[u8] = if name == "Lcl Translation" {
            b"CKMRA"
        } else {
            b"CMR"
        };
        let extrapolations = [(); 2].map(|()| kinds[self.pick(kinds.len() as u32) as usize]);
        self.object("AnimationCurve", "", "", |author| {
            author.node("KeyTime", vec![Longs(times)], |_| {});
            author.node("KeyValueFloat", vec![Reals(values)], |_| {});
            author.node(
                "KeyAttrFlags",
                vec![Ints(attributes.iter().map(|a| a.0).collect())],
                |_| {},
            );
            author.node(
                "KeyAttrDataFloat",
                vec![Reals(attributes.iter().flat_map(|a| a.1).collect())],
                |_| {},
            );
            author.node("KeyAttrRefCount", vec![Ints(vec![1; count])], |_| {});
            for (name, kind) in ["Pre-Extrapolation", "Post-Extrapolation"]
                .into_iter()
                .zip(extrapolations)
            {
                author.node(name, vec![], |author| {
                    author.node("Type", vec![Int(i64::from(kind))], |_| {});
                    let repetition = i64::from(author.pick(4)) - 1;
                    author.node("Repetition", vec![Int(repetition)], |_| {});
                });
            }
        })
    }

    /// Flags and data of a key: constant, linear, or cubic with automatic, user or TCB tangents.
    fn attribute(&mut self) -> (i32, [f32; 4]) {
        let mut flags = match self.pick(8) {
            0 => return (0x2 | (self.pick(2) as i32) << 8, [0.0; 4]),
            1 => return (0x4, [0.0; 4]),
            2 => {
                return (
                    0x208,
                    [
                        self.real(0.9) as f32,
                        self.real(0.9) as f32,
                        self.real(0.9) as f32,
                        0.0,
                    ],
                );
            }
            3 | 4 => 0x408,
            _ => 0x108 | (self.pick(8) as i32) << 12,
        };
        flags |= (self.pick(4) as i32) << 24;
        let weights = [(); 2].map(|()| 500 + self.pick(7500));
        let packed = f32::from_bits(weights[0] | weights[1] << 16);
        let slope = if flags & 0x400 != 0 { 60.0 } else { 700.0 };
        (
            flags,
            [
                self.real(slope) as f32,
                self.real(slope) as f32,
                packed,
                0.0,
            ],
        )
    }
}

#[test]
fn random_scenes_are_where_ufbx_has_them() {
    for seed in 0..300 {
        let times: Vec<f64> = (0..24).map(|i| f64::from(i) * 0.0973 - 0.61).collect();
        compare_bytes(&scene(seed), &times, &format!("scene {seed}"));
    }
}
