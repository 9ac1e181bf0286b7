//! ASF: the skeleton. Its sections come in any order, so bones are collected first and put together at the end.

use super::error::AcclaimError;
use super::lines::{Line, lines, short};
use nalgebra::{UnitQuaternion, Vector3};
use std::collections::BTreeMap;

/// Most bones that a skeleton may have. Chosen, as a bound on memory.
const MOST_BONES: usize = 1 << 16;
/// The CMU database, and those made like it, have `length` units in an inch.
const INCH_M: f64 = 0.0254;
const ROOT: &str = "root";

/// One number of a bone in a frame: along or about one of its axes, or a change of its length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Freedom {
    Translation(usize),
    Rotation(usize),
    Length,
}

/// A bone, or the end of one without children.
#[derive(Clone, Debug)]
pub(super) struct Bone {
    pub name: String,
    pub parent: Option<usize>,
    /// From its parent's start to its own, in world axes and the file's units.
    pub offset: Vector3<f64>,
    /// World from the bone's axes.
    pub axes: UnitQuaternion<f64>,
    /// In the order of its numbers in a frame, in which rotations are applied too.
    pub freedoms: Vec<Freedom>,
    /// Whether it is only the end of its parent.
    pub is_end: bool,
}

/// The skeleton of an ASF file.
pub(super) struct Skeleton {
    /// The root first, parents before their children.
    pub bones: Vec<Bone>,
    /// Metres per unit, if stated.
    pub unit_m: Option<f64>,
    /// Whether angles are in radians instead of degrees.
    pub is_radian: bool,
}

/// A bone as the file has it: the unit of its angles may be stated later.
struct Draft {
    line: usize,
    name: String,
    direction: [f64; 3],
    length: f64,
    angles: [f64; 3],
    order: [usize; 3],
    freedoms: Vec<Freedom>,
}

/// What has been read so far.
struct Reader {
    /// Units per inch.
    length: Option<f64>,
    is_radian: bool,
    root: Draft,
    position: [f64; 3],
    bones: Vec<Draft>,
    /// Names of every bone's children, with the lines that name them.
    children: BTreeMap<String, Vec<(usize, String)>>,
    /// How many names the hierarchy has so far.
    named: usize,
}

/// Reads a skeleton.
pub(super) fn read(text: &str) -> Result<Skeleton, AcclaimError> {
    let mut reader = Reader {
        length: None,
        is_radian: false,
        root: Draft::new(0, ROOT),
        position: [0.0; 3],
        bones: Vec::new(),
        children: BTreeMap::new(),
        named: 0,
    };
    let mut section = String::new();
    for mut line in lines(text) {
        if line.key.starts_with(':') {
            section = line.key.to_ascii_lowercase();
            continue;
        }
        match section.as_str() {
            ":units" => reader.unit(&mut line)?,
            ":root" => reader.root(&mut line)?,
            ":bonedata" => reader.bone(&mut line)?,
            ":hierarchy" => reader.children(&mut line)?,
            _ => {}
        }
    }
    match reader.bones.is_empty() {
        true => Err(AcclaimError::NoBones),
        false => reader.skeleton(),
    }
}

impl Draft {
    fn new(line: usize, name: &str) -> Self {
        Self {
            line,
            name: name.to_owned(),
            direction: [0.0; 3],
            length: 0.0,
            angles: [0.0; 3],
            order: [0, 1, 2],
            freedoms: Vec::new(),
        }
    }
}

impl Reader {
    fn unit(&mut self, line: &mut Line) -> Result<(), AcclaimError> {
        match line.key.to_ascii_lowercase().as_str() {
            "length" => self.length = Some(line.number("a length")?),
            "angle" => {
                let unit = line.expect("deg or rad")?;
                self.is_radian = match unit.to_ascii_lowercase().as_str() {
                    "deg" | "degrees" => false,
                    "rad" | "radians" => true,
                    _ => return Err(line.unexpected(unit, "deg or rad")),
                };
            }
            _ => {}
        }
        Ok(())
    }

    fn root(&mut self, line: &mut Line) -> Result<(), AcclaimError> {
        match line.key.to_ascii_lowercase().as_str() {
            "order" => self.root.freedoms = freedoms(line)?,
            "axis" => {
                let letters = line.expect("an order of axes")?;
                self.root.order = order(line, letters)?;
            }
            "position" => self.position = line.numbers("a position of three numbers")?,
            "orientation" => self.root.angles = line.numbers("an orientation of three numbers")?,
            _ => {}
        }
        Ok(())
    }

    /// Reads a line about a bone; its limits, masses and markers are skipped.
    fn bone(&mut self, line: &mut Line) -> Result<(), AcclaimError> {
        let key = line.key.to_ascii_lowercase();
        if key == "begin" {
            too_many(line, self.bones.len())?;
            self.bones.push(Draft::new(line.number, ""));
            return Ok(());
        }
        let Some(bone) = self.bones.last_mut() else {
            return Err(line.unexpected(line.key, "`begin`"));
        };
        match key.as_str() {
            "name" => bone.name = line.expect("a name")?.to_owned(),
            "direction" => bone.direction = line.numbers("a direction of three numbers")?,
            "length" => bone.length = line.number("a length")?,
            "axis" => {
                bone.angles = line.numbers("three angles and an order of axes")?;
                bone.order = match line.next() {
                    Some(letters) => order(line, letters)?,
                    None => [0, 1, 2],
                };
            }
            "dof" => bone.freedoms = freedoms(line)?,
            _ => {}
        }
        Ok(())
    }

    /// Reads a line of the hierarchy: a bone and its children.
    fn children(&mut self, line: &mut Line) -> Result<(), AcclaimError> {
        if matches!(line.key.to_ascii_lowercase().as_str(), "begin" | "end") {
            return Ok(());
        }
        let children = self.children.entry(line.key.to_owned()).or_default();
        self.named += 1;
        while let Some(child) = line.next() {
            self.named += 1;
            too_many(line, self.named / 2)?;
            children.push((line.number, child.to_owned()));
        }
        Ok(())
    }

    /// Puts the bones in the order of the hierarchy, depth first.
    fn skeleton(mut self) -> Result<Skeleton, AcclaimError> {
        let broken = |line, reason, remedy| {
            Err(AcclaimError::Broken {
                line,
                reason,
                remedy,
            })
        };
        // By name, because the hierarchy names bones in its own order.
        let mut drafts: BTreeMap<String, Draft> = BTreeMap::new();
        for draft in std::mem::take(&mut self.bones) {
            let (line, name) = (draft.line, short(&draft.name));
            if draft.name.is_empty() {
                return broken(line, "the bone has no name".to_owned(), "give it one");
            }
            if draft.name == ROOT || drafts.insert(draft.name.clone(), draft).is_some() {
                let reason = format!("a second bone is called `{name}`");
                return broken(line, reason, "rename one of them");
            }
        }
        let mut bones = vec![self.finished(&self.root, None, Vector3::from(self.position))];
        let mut open = self.children_of(ROOT, 0, Vector3::zeros());
        while let Some((line, name, parent, offset)) = open.pop() {
            let Some(draft) = drafts.remove(&name) else {
                let name = short(&name);
                let reason = format!("bone `{name}` is in the hierarchy twice or not in :bonedata");
                return broken(line, reason, "repair the hierarchy");
            };
            // Children begin at the end of their parent.
            let along = Vector3::from(draft.direction) * draft.length;
            let bone = bones.len();
            bones.push(self.finished(&draft, Some(parent), offset));
            let behind = self.children_of(&name, bone, along);
            // A bone without children has an end that nothing else marks.
            if behind.is_empty() {
                let end = Draft::new(0, &format!("{name}_end"));
                bones.push(self.finished(&end, Some(bone), along));
            }
            open.extend(behind);
        }
        if let Some(draft) = drafts.values().min_by_key(|draft| draft.line) {
            let name = short(&draft.name);
            let reason = format!("bone `{name}` has no parent in :hierarchy");
            return broken(draft.line, reason, "add it there");
        }
        let length = self.length.filter(|length| *length > 0.0);
        Ok(Skeleton {
            bones,
            unit_m: length.map(|length| INCH_M / length),
            is_radian: self.is_radian,
        })
    }

    /// Children of a bone, the last first: line, name, index of the parent, and offset from the parent's start.
    fn children_of(
        &mut self,
        name: &str,
        parent: usize,
        offset: Vector3<f64>,
    ) -> Vec<(usize, String, usize, Vector3<f64>)> {
        let children = self.children.remove(name).unwrap_or_default();
        let children = children.into_iter().rev();
        children
            .map(|(line, child)| (line, child, parent, offset))
            .collect()
    }

    /// The finished bone of a draft.
    fn finished(&self, draft: &Draft, parent: Option<usize>, offset: Vector3<f64>) -> Bone {
        Bone {
            name: draft.name.clone(),
            parent,
            offset,
            axes: self.axes(draft),
            freedoms: draft.freedoms.clone(),
            is_end: parent.is_some() && draft.line == 0,
        }
    }

    /// The rotation by the angles about x, y and z, applied in the bone's order about fixed axes.
    fn axes(&self, draft: &Draft) -> UnitQuaternion<f64> {
        let about = |axis: usize| {
            let angle = draft.angles[axis];
            let angle = if self.is_radian {
                angle
            } else {
                angle.to_radians()
            };
            UnitQuaternion::from_axis_angle(&Vector3::ith_axis(axis), angle)
        };
        // Fixed axes: the first rotation is the rightmost factor.
        let [first, second, third] = draft.order;
        about(third) * about(second) * about(first)
    }
}

fn too_many(line: &Line, bones: usize) -> Result<(), AcclaimError> {
    if bones < MOST_BONES {
        return Ok(());
    }
    Err(line.broken(format!("more than {MOST_BONES} bones"), "split the file"))
}

/// An order of axes such as `XYZ`.
fn order(line: &Line, letters: &str) -> Result<[usize; 3], AcclaimError> {
    let axes: Vec<usize> = letters
        .chars()
        .filter_map(|letter| "XYZ".find(letter.to_ascii_uppercase()))
        .collect();
    match axes[..] {
        [a, b, c] if a != b && b != c && a != c && letters.len() == 3 => Ok([a, b, c]),
        _ => Err(line.unexpected(letters, "an order of axes such as XYZ")),
    }
}

fn freedoms(line: &mut Line) -> Result<Vec<Freedom>, AcclaimError> {
    let mut freedoms = Vec::new();
    while let Some(word) = line.next() {
        freedoms.push(match word.to_ascii_lowercase().as_str() {
            "tx" => Freedom::Translation(0),
            "ty" => Freedom::Translation(1),
            "tz" => Freedom::Translation(2),
            "rx" => Freedom::Rotation(0),
            "ry" => Freedom::Rotation(1),
            "rz" => Freedom::Rotation(2),
            "l" => Freedom::Length,
            _ => return Err(line.unexpected(word, "tx, ty, tz, rx, ry, rz or l")),
        });
    }
    Ok(freedoms)
}
