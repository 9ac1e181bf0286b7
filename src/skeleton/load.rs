//! Loads a [`Skeleton`] from MJCF text.
//!
//! The parser hands out MJCF's elements with defaults resolved. What MuJoCo's compiler makes of them is done in
//! [`super::build`] and the files that it uses, so that masses, frames and drives are those that MuJoCo would compile.

use super::build::{self, Built};
use super::error::{Defect, SkeletonError};
use super::{Skeleton, guard, slots};
use crate::file;
use mjcf_rs::Model;
use sha2::{Digest, Sha256};
use std::path::Path;

/// Characters compiled into the library: name, MJCF, slots as JSON.
const BUILT_IN: [(&str, &str, &str); 3] = [
    (
        "humanoid",
        include_str!("../../skeletons/humanoid.xml"),
        include_str!("../../skeletons/humanoid.json"),
    ),
    (
        "marathon",
        include_str!("../../skeletons/marathon.xml"),
        include_str!("../../skeletons/marathon.json"),
    ),
    (
        "robot",
        include_str!("../../skeletons/robot.xml"),
        include_str!("../../skeletons/robot.json"),
    ),
];

impl Skeleton {
    /// Most bytes that are read of an MJCF file, and of the slots beside it.
    pub const MOST_BYTES: u64 = guard::MOST_BYTES;

    /// Names of the built-in characters, which [`Skeleton::load`] takes.
    pub fn built_in() -> impl Iterator<Item = &'static str> {
        BUILT_IN.iter().map(|(name, ..)| *name)
    }

    /// Loads a built-in character by name, or an MJCF file by path.
    ///
    /// The humanoid slots of `dir/robot.xml` are read from `dir/robot.json` if that file exists, and otherwise guessed from
    /// the names of the bodies (see [`Skeleton::from_mjcf`]). Something has to drive each joint of a file's character.
    ///
    /// # Errors
    /// [`SkeletonError::UnknownName`] for a word that is neither a built-in character nor a file,
    /// [`SkeletonError::Read`] for a file that cannot be read, and the errors of [`Skeleton::from_mjcf`].
    pub fn load(name_or_path: impl AsRef<Path>) -> Result<Self, SkeletonError> {
        let path = name_or_path.as_ref();
        let built_in = BUILT_IN.iter().find(|(name, ..)| path == Path::new(name));
        if let Some((name, xml, json)) = built_in {
            return Self::from_mjcf(name, xml, Some(json));
        }
        // A bare word that is no file was meant as a name.
        if path.extension().is_none() && !path.exists() {
            return Err(SkeletonError::UnknownName {
                name: path.to_string_lossy().into_owned(),
            });
        }
        let xml = read(path)?;
        let beside = path.with_extension("json");
        // A link that leads nowhere is there: who made it wanted it read.
        let is_there = beside.symlink_metadata().is_ok();
        let json = is_there.then(|| read(&beside)).transpose()?;
        let name = path.file_stem().unwrap_or(path.as_os_str());
        Self::from_mjcf(&name.to_string_lossy(), &xml, json.as_deref())
            .and_then(Self::with_motors)
            .map_err(|error| error.in_files(path, &beside))
    }

    /// What the character's file states, is not simulated, and takes no more than a little freedom away; in words, one sentence each.
    pub fn left_out(&self) -> Vec<String> {
        let tendons = guard::limited_tendons(&self.mjcf).into_iter();
        let told = |name| format!("the limits of tendon `{name}` are not simulated");
        tendons.map(told).collect()
    }

    /// Makes a character of MJCF text, with the masses, frames and joints that MuJoCo would compile.
    ///
    /// The text has to describe one character whose top body has a free joint. It may also describe static scenery, which
    /// is ignored. `slots_json` is `{"slots": {"hips": "pelvis", …}}`; without it, slots are guessed from the names of the
    /// bodies.
    ///
    /// Position actuators become drives. A joint that has only a torque motor takes its drive from its `stiffness` and
    /// `damping` if that spring reaches the motor's limit within a radian; otherwise it gets a stiffness of
    /// 4 × (limit) N·m/rad and a tenth of that as damping, N·m·s/rad.
    ///
    /// # Errors
    /// [`SkeletonError::Mjcf`] for text that is no MJCF, or describes something else than one such character;
    /// [`SkeletonError::Slots`] for slots that cannot be read or name no body.
    pub fn from_mjcf(
        name: &str,
        xml: &str,
        slots_json: Option<&str>,
    ) -> Result<Self, SkeletonError> {
        guard::check(name, xml)?;
        let model = Model::from_str(xml, ".").map_err(|e| {
            let defect = Defect::new(format!("not valid MJCF ({})", one_line(&e)), OPENS);
            SkeletonError::mjcf(name, None, defect)
        })?;
        let Built { bodies, nq, nv } = build::bodies(name, &model)?;
        let slots = match slots_json {
            Some(json) => slots::from_json(json, &bodies)
                .map_err(|defect| SkeletonError::slots(name, defect))?,
            None => slots::from_names(&bodies),
        };
        Ok(Self {
            name: name.into(),
            sha256: format!("{:x}", Sha256::digest(xml.as_bytes())),
            mjcf: xml.into(),
            bodies,
            slots,
            nq,
            nv,
        })
    }
}

fn read(path: &Path) -> Result<String, SkeletonError> {
    file::text_at_most(path, Skeleton::MOST_BYTES).map_err(|source| SkeletonError::Read {
        path: path.to_owned(),
        source,
    })
}

/// What to do about text that the parser refuses: MuJoCo names the line and the attribute.
const OPENS: &str = "correct the file until MuJoCo opens it";

fn one_line(message: &impl ToString) -> String {
    let text = message.to_string();
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
