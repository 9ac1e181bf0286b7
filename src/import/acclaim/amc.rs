//! AMC: rows of numbers for a skeleton's bones, frame after frame.

use super::asf::{Freedom, Skeleton};
use super::error::AcclaimError;
use super::lines::{Line, lines, short};
use crate::clip::Problem;
use crate::import::names::first_few;
use std::collections::BTreeMap;

/// A bone's numbers in a row.
pub(super) struct Column {
    /// Index of the bone in the skeleton.
    pub bone: usize,
    /// Index of its first number in a row.
    pub first: usize,
}

/// The frames of an AMC file.
pub(super) struct Motion {
    /// The bones that the first frame names. All others stay at rest.
    pub columns: Vec<Column>,
    /// Numbers of all frames, one frame after the other, in the file's units and radians.
    numbers: Vec<f64>,
    width: usize,
    /// Frames per second, Hz, if stated.
    pub rate: Option<f64>,
    pub problems: Vec<Problem>,
}

impl Motion {
    /// Number of frames, at least one.
    pub fn frames(&self) -> usize {
        self.numbers.len() / self.width
    }

    /// The numbers of frame `frame`.
    pub fn row(&self, frame: usize) -> &[f64] {
        &self.numbers[frame * self.width..(frame + 1) * self.width]
    }
}

/// What has been read so far.
struct Reader<'s> {
    skeleton: &'s Skeleton,
    /// Bones by name.
    bones: BTreeMap<&'s str, usize>,
    is_radian: bool,
    rate: Option<f64>,
    columns: Vec<Column>,
    /// By bone: its column, and the last frame that named it, counted from 1.
    places: BTreeMap<usize, (usize, usize)>,
    numbers: Vec<f64>,
    width: usize,
    /// How many frames have begun, and how many bones the last of them has named so far.
    begun: usize,
    named: usize,
    problems: Vec<Problem>,
}

/// Reads the motion of `skeleton`. A last frame that was cut off is left out, with a warning.
pub(super) fn read(text: &str, skeleton: &Skeleton) -> Result<Motion, AcclaimError> {
    let bones = skeleton.bones.iter().enumerate();
    let own = bones.filter(|(_, bone)| !bone.is_end);
    let mut reader = Reader {
        skeleton,
        bones: own.map(|(at, bone)| (bone.name.as_str(), at)).collect(),
        is_radian: skeleton.is_radian,
        rate: None,
        columns: Vec::new(),
        places: BTreeMap::new(),
        numbers: Vec::new(),
        width: 0,
        begun: 0,
        named: 0,
        problems: Vec::new(),
    };
    let mut lines = lines(text).peekable();
    while let Some(mut line) = lines.next() {
        let read = reader.line(&mut line);
        // An error in the last line of an incomplete frame comes from the cut: the frame is left out below.
        if lines.peek().is_some() || reader.named == reader.columns.len() {
            read?;
        }
    }
    reader.motion()
}

impl Reader<'_> {
    fn line(&mut self, line: &mut Line) -> Result<(), AcclaimError> {
        if line.key.starts_with(':') {
            return self.keyword(line);
        }
        if line.key.bytes().all(|byte| byte.is_ascii_digit()) {
            self.check_whole(line)?;
            self.begun += 1;
            self.named = 0;
            return Ok(());
        }
        match self.begun {
            0 => Err(line.unexpected(line.key, "the number of a frame")),
            _ => self.bone(line),
        }
    }

    fn keyword(&mut self, line: &mut Line) -> Result<(), AcclaimError> {
        match line.key.to_ascii_uppercase().as_str() {
            ":DEGREES" => self.is_radian = false,
            ":RADIANS" => self.is_radian = true,
            ":SAMPLES-PER-SECOND" => {
                let expected = "a rate from 1 to 10000";
                let rate = line.number(expected)?;
                if !(1.0..=10_000.0).contains(&rate) {
                    return Err(line.unexpected(&rate.to_string(), expected));
                }
                self.rate = Some(rate);
            }
            _ => {}
        }
        Ok(())
    }

    /// Checks that the frame before `line` named all bones of the first one.
    fn check_whole(&self, line: &Line) -> Result<(), AcclaimError> {
        let (named, all) = (self.named, self.columns.len());
        if self.begun > 0 && named != all {
            return Err(line.broken(
                format!("the frame before has {named} of the first one's {all} bones"),
                "write the file again",
            ));
        }
        Ok(())
    }

    fn bone(&mut self, line: &mut Line) -> Result<(), AcclaimError> {
        let name = short(line.key);
        let Some(&bone) = self.bones.get(line.key) else {
            let reason = format!("bone `{name}` isn't in its skeleton");
            return Err(line.broken(reason, "put the right .asf beside it"));
        };
        // The first frame defines the columns; every later frame must name each of them once.
        let place = match self.places.get(&bone) {
            None if self.begun == 1 => self.columns.len(),
            Some(&(place, frame)) if frame < self.begun => place,
            _ => {
                let reason =
                    format!("bone `{name}` is in this frame twice or not in the first one");
                return Err(line.broken(reason, "write the file again"));
            }
        };
        let freedoms = &self.skeleton.bones[bone].freedoms;
        let mut row = Vec::with_capacity(freedoms.len());
        while row.len() < freedoms.len() {
            let number = line.number("a number for each of the bone's degrees of freedom")?;
            row.push(number);
        }
        if let Some(extra) = line.next() {
            return Err(line.unexpected(extra, "the end of the bone's degrees of freedom"));
        }
        self.store(bone, place, &row);
        Ok(())
    }

    /// Stores a bone's numbers of the current frame.
    fn store(&mut self, bone: usize, place: usize, row: &[f64]) {
        if place == self.columns.len() {
            let first = self.width;
            self.columns.push(Column { bone, first });
            self.width += row.len();
        }
        let start = (self.begun - 1) * self.width;
        self.numbers.resize(start.max(self.numbers.len()), 0.0);
        let first = start + self.columns[place].first;
        let end = first + row.len();
        self.numbers.resize(end.max(self.numbers.len()), 0.0);
        self.numbers[first..end].copy_from_slice(row);
        self.places.insert(bone, (place, self.begun));
        self.named += 1;
    }

    fn motion(mut self) -> Result<Motion, AcclaimError> {
        let (named, all) = (self.named, self.columns.len());
        // A single frame is whole by definition: it defines what a frame has.
        let cut = usize::from(self.begun > 1 && named != all);
        if cut > 0 {
            self.problems.push(Problem::warning(
                "frame-cut",
                format!("the last frame has {named} of {all} bones and is left out; the file may be cut off"),
            ));
        }
        if self.begun == 0 || self.width == 0 {
            return Err(AcclaimError::NoFrames);
        }
        self.numbers.resize((self.begun - cut) * self.width, 0.0);
        self.problems.extend(self.stretched());
        self.convert_degrees();
        Ok(Motion {
            columns: self.columns,
            numbers: self.numbers,
            width: self.width,
            rate: self.rate,
            problems: self.problems,
        })
    }

    fn convert_degrees(&mut self) {
        if self.is_radian {
            return;
        }
        let freedoms = |column: &Column| self.skeleton.bones[column.bone].freedoms.clone();
        let kinds: Vec<Freedom> = self.columns.iter().flat_map(freedoms).collect();
        for row in self.numbers.chunks_exact_mut(self.width) {
            for (number, kind) in row.iter_mut().zip(&kinds) {
                if let Freedom::Rotation(_) = kind {
                    *number = number.to_radians();
                }
            }
        }
    }

    /// A warning about bones that change their length, which joints can't.
    fn stretched(&self) -> Option<Problem> {
        let bones = self.columns.iter().map(|c| &self.skeleton.bones[c.bone]);
        let stretched = bones.filter(|bone| bone.freedoms.contains(&Freedom::Length));
        let names: Vec<String> = stretched.map(|bone| format!("`{}`", bone.name)).collect();
        let list = first_few(names.iter().cloned());
        (!names.is_empty()).then(|| {
            Problem::warning(
                "bone-lengths-left-out",
                format!(
                    "these bones change their length, which joints can't, so it is left out: {list}"
                ),
            )
        })
    }
}
