//! Small files, each made to show one thing, with expected values worked out by hand.

use super::{FbxScene, read};
use crate::import::scene::Scene;
use fbxcel::low::FbxVersion;
use fbxcel::writer::v7400::binary::Writer;
use std::io::Cursor;

const SECOND: i64 = 46_186_158_000;

enum Value<'a> {
    Int(i64),
    Real(f64),
    Text(&'a str),
    Longs(&'a [i64]),
    Floats(&'a [f32]),
}
use Value::{Floats, Int, Longs, Real, Text};

struct Author(Writer<Cursor<Vec<u8>>>);

impl Author {
    fn node(&mut self, name: &str, values: &[Value], inside: impl FnOnce(&mut Self)) {
        let mut attributes = self.0.new_node(name).expect("memory takes all");
        for value in values {
            match *value {
                Int(value) => attributes.append_i64(value),
                Real(value) => attributes.append_f64(value),
                Text(text) => attributes.append_string_direct(text),
                Longs(list) => attributes.append_arr_i64_from_iter(None, list.iter().copied()),
                Floats(list) => attributes.append_arr_f32_from_iter(None, list.iter().copied()),
            }
            .expect("memory takes all");
        }
        inside(self);
        self.0.close_node().expect("a node is open");
    }

    fn object(&mut self, class: &str, id: i64, name: &str, properties: &[(&str, &[f64])]) {
        let kind = if class == "Model" { "LimbNode" } else { "" };
        self.node(class, &[Int(id), Text(name), Text(kind)], |author| {
            author.node("Properties70", &[], |author| {
                for (name, numbers) in properties {
                    let mut values = vec![Text(name), Text("Number"), Text(""), Text("A")];
                    values.extend(numbers.iter().map(|&number| Real(number)));
                    author.node("P", &values, |_| {});
                }
            });
        });
    }

    fn link(&mut self, child: i64, parent: i64, property: &str) {
        let kind = if property.is_empty() { "OO" } else { "OP" };
        let values = [Text(kind), Int(child), Int(parent), Text(property)];
        self.node("C", &values, |_| {});
    }
}

/// Switches of a layer.
type Layer<'a> = &'a [(&'a str, &'a [f64])];

/// A joint at x = 5 whose take has layers that put x to 1, 10, 100, and so on; the first one's y is what a curve of
/// these values, tied to its axis `axis`, gives.
fn file(layers: &[Layer], axis: &str, values: &[f32]) -> Vec<u8> {
    let writer = Writer::new(Cursor::new(Vec::new()), FbxVersion::V7_4).expect("a known version");
    let mut author = Author(writer);
    let (layer, curve_node) = (|k: usize| 10 + k as i64, |k: usize| 100 + k as i64);
    author.node("Objects", &[], |author| {
        author.object(
            "Model",
            1,
            "joint",
            &[("Lcl Translation", &[5.0, 0.0, 0.0])],
        );
        author.object("AnimationStack", 2, "take", &[]);
        for (k, switches) in layers.iter().enumerate() {
            author.object("AnimationLayer", layer(k), "layer", switches);
            let x = 10f64.powi(k as i32);
            author.object("AnimationCurveNode", curve_node(k), "T", &[("d|X", &[x])]);
        }
        author.node("AnimationCurve", &[Int(3), Text(""), Text("")], |author| {
            author.node("KeyTime", &[Longs(&[0, SECOND])], |_| {});
            author.node("KeyValueFloat", &[Floats(values)], |_| {});
        });
    });
    author.node("Connections", &[], |author| {
        for k in 0..layers.len() {
            author.link(layer(k), 2, "");
            author.link(curve_node(k), layer(k), "");
            author.link(curve_node(k), 1, "Lcl Translation");
        }
        author.link(3, curve_node(0), axis);
    });
    author.node("Takes", &[], |author| {
        author.node("Take", &[Text("take")], |author| {
            author.node("LocalTime", &[Int(SECOND), Int(3 * SECOND)], |_| {});
        });
    });
    let done = author.0.finalize(&Default::default());
    done.expect("memory takes all").into_inner()
}

fn scene(layers: &[Layer], axis: &str) -> FbxScene {
    read(&file(layers, axis, &[7.0, 7.0])).expect("it is read")
}

#[test]
fn muted_layers_and_those_beside_a_solo_one_are_left_out() {
    const MUTE: Layer = &[("Mute", &[1.0])];
    const SOLO: Layer = &[("Solo", &[1.0])];
    const BOTH: Layer = &[("Mute", &[1.0]), ("Solo", &[1.0])];
    const NONE: Layer = &[("Mute", &[0.0]), ("Solo", &[0.0])];
    // The first layer replaces what the joint has at rest, 5; the others add to what is under them.
    for (layers, x, silent) in [
        ([NONE, NONE, NONE], 111.0, 0),
        ([NONE, MUTE, NONE], 101.0, 1),
        ([MUTE, NONE, NONE], 115.0, 1),
        ([NONE, SOLO, NONE], 15.0, 2),
        ([SOLO, NONE, SOLO], 101.0, 1),
        ([NONE, BOTH, NONE], 5.0, 3),
    ] {
        let scene = scene(&layers, "d|Y");
        assert_eq!(scene.world(Some((0, 0.5)))[0][(0, 3)], x);
        let problems = &scene.takes()[0].problems;
        let told = problems.iter().find(|problem| problem.id == "muted-layers");
        assert_eq!(told.is_some(), silent > 0);
        assert!(told.is_none_or(|told| told.message.contains(&format!(" {silent} muted"))));
    }
}

#[test]
fn axes_have_long_and_short_names() {
    for (axis, place) in [
        ("d|X", [7.0, 0.0, 0.0]),
        ("d|Y", [1.0, 7.0, 0.0]),
        ("Y", [1.0, 7.0, 0.0]),
        ("d|Z", [1.0, 0.0, 7.0]),
        ("Z", [1.0, 0.0, 7.0]),
    ] {
        let world = scene(&[&[]], axis).world(Some((0, 0.5)))[0];
        assert_eq!([0, 1, 2].map(|row| world[(row, 3)]), place, "{axis}");
    }
}

#[test]
fn the_list_of_takes_tells_the_span_where_the_take_itself_does_not() {
    let scene = scene(&[&[]], "d|Y");
    let take = &scene.takes()[0];
    assert_eq!((take.start, take.end), (1.0, 3.0));
}

#[test]
fn a_broken_curve_is_named_by_take_and_joint() {
    let scene = read(&file(&[&[]], "d|Y", &[7.0])).expect("other takes may be whole");
    let fault = scene.takes()[0].fault.as_ref().expect("a fault");
    let place = "take `take`, joint `joint`, animation curve 3";
    assert_eq!(fault.place.as_deref(), Some(place));
}
