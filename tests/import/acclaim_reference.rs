//! Acclaim's formula, straight from its description, in plain matrices: a bone's rotation is L = C · M · C⁻¹, and it begins at
//! its parent's direction × length.

use super::bvh::{Matrix, Place, about, times};
use std::collections::BTreeMap;

fn apply(m: &Matrix, p: Place) -> Place {
    std::array::from_fn(|r| (0..3).map(|k| m[r][k] * p[k]).sum())
}

fn add(a: Place, b: Place) -> Place {
    std::array::from_fn(|k| a[k] + b[k])
}

fn transposed(m: &Matrix) -> Matrix {
    std::array::from_fn(|r| std::array::from_fn(|c| m[c][r]))
}

fn axis(letter: char) -> usize {
    "xyz".find(letter.to_ascii_lowercase()).expect("x, y, or z")
}

/// Rotations about the axes that `order` names, the first applied first.
fn euler(order: &str, degrees: impl Fn(usize) -> f64) -> Matrix {
    order.chars().fold(about(0, 0.0), |turn, letter| {
        times(&about(axis(letter), degrees(axis(letter))), &turn)
    })
}

#[derive(Clone, Default)]
struct Bone {
    parent: String,
    /// From its start to its end: direction × length.
    along: Place,
    c: Matrix,
    dof: Vec<String>,
}

/// The bones of a skeleton by name, and their order, parents first.
pub(super) struct Asf {
    bones: BTreeMap<String, Bone>,
    order: Vec<String>,
    position: Place,
}

/// Number of degrees in one of the file's units of angle.
fn degrees_of(text: &str, radians: &str) -> f64 {
    if text.contains(radians) {
        180.0 / std::f64::consts::PI
    } else {
        1.0
    }
}

pub(super) fn asf(text: &str) -> Asf {
    let unit = degrees_of(text, "angle rad");
    let mut asf = Asf {
        bones: BTreeMap::from([("root".to_owned(), Bone::default())]),
        order: vec!["root".to_owned()],
        position: [0.0; 3],
    };
    let (mut name, mut bone, mut length) = ("root".to_owned(), Bone::default(), 0.0);
    let (mut angles, mut order) = ([0.0; 3], "xyz".to_owned());
    let mut in_tree = false;
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let place =
            || -> Place { std::array::from_fn(|k| words[k + 1].parse().expect("a number")) };
        match words.first().copied().unwrap_or_default() {
            ":hierarchy" => in_tree = true,
            "order" | "dof" => bone.dof = words[1..].iter().map(|w| w.to_lowercase()).collect(),
            "orientation" => angles = place(),
            "position" => asf.position = place(),
            "axis" if words.len() == 2 => order = words[1].to_owned(),
            "axis" => (angles, order) = (place(), words[4].to_owned()),
            "name" => name = words[1].to_owned(),
            "direction" => bone.along = place(),
            "length" if name != "root" => length = words[1].parse().expect("a number"),
            ":bonedata" | "end" if !in_tree => {
                bone.along = bone.along.map(|x| x * length);
                bone.c = euler(&order, |axis| angles[axis] * unit);
                asf.bones.insert(name.clone(), std::mem::take(&mut bone));
                name = "unnamed".to_owned();
            }
            "end" => break,
            "begin" => {}
            parent if in_tree => {
                for child in &words[1..] {
                    asf.bones.get_mut(*child).expect("a bone").parent = parent.to_owned();
                    asf.order.push((*child).to_owned());
                }
            }
            _ => {}
        }
    }
    asf
}

/// Where every bone begins and, under its name with `_end`, where it ends, in each frame. Parents must come first in the
/// hierarchy.
pub(super) fn places(asf: &Asf, amc: &str) -> Vec<BTreeMap<String, Place>> {
    let unit = degrees_of(amc, ":RADIANS");
    let mut frames: Vec<BTreeMap<&str, Vec<f64>>> = Vec::new();
    for line in amc.lines().filter(|line| !line.starts_with(['#', ':'])) {
        let mut words = line.split_whitespace();
        let key = words.next().expect("a word");
        let numbers = words.map(|word| word.parse().expect("a number"));
        match key.parse::<u32>() {
            Ok(_) => frames.push(BTreeMap::new()),
            Err(_) => drop(
                frames
                    .last_mut()
                    .expect("a frame")
                    .insert(key, numbers.collect()),
            ),
        }
    }
    let place = |frame: &BTreeMap<&str, Vec<f64>>| {
        let mut turns: BTreeMap<&str, Matrix> = BTreeMap::new();
        let mut places: BTreeMap<String, Place> = BTreeMap::new();
        for name in &asf.order {
            let bone = &asf.bones[name];
            let (mut m, mut shift) = (about(0, 0.0), [0.0; 3]);
            for (dof, number) in bone
                .dof
                .iter()
                .zip(frame.get(name.as_str()).into_iter().flatten())
            {
                let at = axis(dof.chars().last().expect("a letter"));
                match dof.starts_with('t') {
                    true => shift[at] += number,
                    false => m = times(&about(at, number * unit), &m),
                }
            }
            let local = times(&times(&bone.c, &m), &transposed(&bone.c));
            let shift = apply(&bone.c, shift);
            let (above, start) = match turns.get(bone.parent.as_str()) {
                Some(above) => (*above, places[&format!("{}_end", bone.parent)]),
                None => (about(0, 0.0), asf.position),
            };
            let start = add(start, apply(&above, shift));
            let turn = times(&above, &local);
            places.insert(name.clone(), start);
            places.insert(format!("{name}_end"), add(start, apply(&turn, bone.along)));
            turns.insert(name, turn);
        }
        places
    };
    frames.iter().map(place).collect()
}
