//! The files that are damaged: our own clips, and small files of others where they are at hand.

use super::fbx::Fbx;
use super::glb::Glb;
use super::random::Random;
use super::tensors::Tensors;
use super::text::Text;
use super::{json, ours, plain, runs};
use mimic_test_support::foreign;
use serde_json::Value;
use std::path::{Path, PathBuf};

const OURS: [(&str, &str); 2] = [("FBX", "kick.fbx"), ("GLB", "walk.glb")];

/// Kind and place in the collection of other people's files.
const THEIRS: [(&str, &str); 47] = [
    ("FBX", "torture-fbx/maya_anim_layers_7500_binary.fbx"),
    ("FBX", "torture-fbx/maya_anim_interpolation_7700_binary.fbx"),
    ("FBX", "torture-fbx/maya_rotation_order_7500_binary.fbx"),
    ("FBX", "torture-fbx/maya_tangent_sign_7700_binary.fbx"),
    ("FBX", "torture-fbx/max_transformed_skin_7500_binary.fbx"),
    ("FBX", "torture-fbx/blender_340_z_up_7400_binary.fbx"),
    ("FBX", "torture-fbx/blender_279_sausage_7400_binary.fbx"),
    ("FBX", "torture-fbx/maya_long_keyframes_7700_binary.fbx"),
    ("FBX", "torture-fbx/animation-space-z-up-m.fbx"),
    ("FBX", "torture-fbx/maya_pivots_7500_binary.fbx"),
    ("FBX", "torture-fbx/maya_resampled_7500_binary.fbx"),
    (
        "ASCII FBX",
        "torture-fbx/synthetic_tcdefinition_127_7100_ascii.fbx",
    ),
    ("ASCII FBX", "torture-fbx/max2009_cube_anim_5800_ascii.fbx"),
    (
        "ASCII FBX",
        "torture-fbx/maya_anim_interpolation_6100_ascii.fbx",
    ),
    ("ASCII FBX", "torture-fbx/maya_auto_clamp_7100_ascii.fbx"),
    ("ASCII FBX", "torture-fbx/animation-multi-clip.fbx"),
    (
        "ASCII FBX",
        "torture-fbx/maya_anim_layers_over_acc_7500_ascii.fbx",
    ),
    (
        "ASCII FBX",
        "torture-fbx/motionbuilder_tangent_tcb_7700_ascii.fbx",
    ),
    ("old FBX", "torture-fbx/max2009_cube_anim_5800_binary.fbx"),
    ("old FBX", "torture-fbx/max2009_cube_anim_6100_binary.fbx"),
    (
        "old FBX",
        "torture-fbx/maya_post_rotate_order_6100_binary.fbx",
    ),
    ("glTF", "khronos/interpolation_test.gltf"),
    ("glTF", "khronos/rigged_simple.gltf"),
    ("glTF", "torture-gltf/01_cs_rotate.gltf"),
    ("glTF", "torture-gltf/03_all_animations.gltf"),
    ("glTF", "torture-gltf/SimpleSkin.gltf"),
    ("glTF", "torture-gltf/animation-splines-sharing.gltf"),
    ("glTF", "torture-gltf/animation.gltf"),
    ("GLB", "bitmoji/bitmoji_jump-flip.glb"),
    ("GLB", "kenney/kenney_character.glb"),
    ("GLB", "mixamo/animations-mixamo-default.glb"),
    ("GLB", "torture-gltf/singleBlendshapeCube_sparse.glb"),
    ("VRM", "vrm/basic_armature.vrm"),
    ("VRM", "vrm/debug_robot.vrm"),
    ("VRM", "vrm/test.vrma"),
    ("BVH", "makehuman/mh_dance1.bvh"),
    ("BVH", "games105/run_forward.bvh"),
    ("BVH", "poser-bvh/run.bvh"),
    ("BVH", "poser-bvh/jog.bvh"),
    ("BVH", "cmu/jumping_jacks.bvh"),
    ("AMC", "cmu/01_01.amc"),
    ("ASF", "cmu/01.asf"),
    ("DeepMimic", "deepmimic/humanoid3d_backflip.txt"),
    ("DeepMimic", "deepmimic/humanoid3d_run.txt"),
    ("DeepMimic", "deepmimic/humanoid3d_walk.txt"),
    ("DeepMimic", "deepmimic/humanoid3d_jog.txt"),
    ("DeepMimic", "deepmimic/dog3d_trot.txt"),
];

/// Kinds that are texts, which may take less memory.
const TEXTS: [&str; 12] = [
    "AMC",
    "ASCII FBX",
    "ASF",
    "BVH",
    "DeepMimic",
    "MJCF",
    "glTF",
    "joint map",
    "metrics",
    "plan",
    "run",
    "slots",
];

/// How many bytes of a long motion are used: its first lines.
const AMC_BYTES: usize = 20_000;

/// What is known of a file's structure.
enum Form {
    Fbx(Fbx),
    Glb(Glb),
    Json(Value),
    Tensors(Tensors),
    Text(Text),
}

/// A file to be damaged.
pub struct Seed {
    pub kind: &'static str,
    pub name: String,
    /// Where files beside it are.
    pub folder: PathBuf,
    /// Bytes of those that are read with it.
    pub beside: usize,
    pub bytes: Vec<u8>,
    form: Form,
}

/// All files that are at hand.
pub fn all() -> Vec<Seed> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let ours = OURS.map(|(kind, name)| (kind, root.join("clips").join(name)));
    let theirs = THEIRS
        .into_iter()
        .filter_map(|(kind, name)| Some((kind, foreign(name)?)));
    let files = ours.into_iter().chain(theirs);
    let can_be_read = |kind: &str| cfg!(feature = "ufbx") || !kind.ends_with(" FBX");
    let files = files.filter(|(kind, _)| can_be_read(kind));
    let imported = files.filter_map(|(kind, path)| {
        let bytes = std::fs::read(&path).expect("a seed can be read");
        seed(kind, &path, bytes)
    });
    let made = ours::all();
    let made = made
        .into_iter()
        .filter_map(|(kind, name, bytes)| seed(kind, Path::new(name), bytes));
    imported.chain(made).collect()
}

/// The files of a run that is made in `folder`, and the plans of all presets.
pub fn of_run(folder: &Path) -> Vec<Seed> {
    runs::make(folder, &ours::clip());
    let files = runs::KINDS.map(|(kind, file)| (kind, file, runs::whole(folder, file)));
    let plans = runs::plans().into_iter();
    let plans = plans.map(|(name, bytes)| ("plan", name, bytes));
    let made = files.into_iter().chain(plans);
    let seeds = made.filter_map(|(kind, name, bytes)| seed(kind, Path::new(name), bytes));
    seeds.collect()
}

fn seed(kind: &'static str, path: &Path, mut bytes: Vec<u8>) -> Option<Seed> {
    if kind == "AMC" {
        let end = bytes.iter().take(AMC_BYTES).rposition(|&b| b == b'\n');
        bytes.truncate(end.map_or(0, |end| end + 1));
    }
    Some(Seed {
        kind,
        name: path.file_name()?.to_string_lossy().into_owned(),
        folder: path.parent()?.to_owned(),
        beside: beside(kind, path),
        form: form(kind, &bytes)?,
        bytes,
    })
}

fn beside(kind: &str, path: &Path) -> usize {
    let size = |path: &Path| std::fs::metadata(path).map_or(0, |about| about.len() as usize);
    match kind {
        "glTF" => size(&path.with_extension("bin")),
        "AMC" => size(&path.with_file_name("01.asf")),
        "ASF" => AMC_BYTES,
        _ => 0,
    }
}

fn form(kind: &str, bytes: &[u8]) -> Option<Form> {
    Some(match kind {
        "FBX" | "old FBX" => Form::Fbx(Fbx::parse(bytes)?),
        "GLB" | "VRM" => Form::Glb(Glb::parse(bytes)?),
        "glTF" | "DeepMimic" | "joint map" | "plan" | "run" | "slots" => {
            Form::Json(serde_json::from_slice(bytes).ok()?)
        }
        "clip" | "motion" | "policy" | "checkpoint" => Form::Tensors(Tensors::parse(bytes)?),
        "MJCF" => Form::Text(Text::xml(bytes)),
        _ => Form::Text(Text::new(bytes)),
    })
}

impl Seed {
    /// Whether the file is a text.
    pub fn is_text(&self) -> bool {
        TEXTS.contains(&self.kind)
    }

    /// A damaged copy: two of three keep to the format's structure.
    pub fn damaged(&self, random: &mut Random) -> Vec<u8> {
        let mut bytes = self.bytes.clone();
        if random.one_in(3) {
            plain::mutate(&mut bytes, random);
            return bytes;
        }
        match &self.form {
            Form::Fbx(fbx) => fbx.mutated(random),
            Form::Glb(glb) => glb.mutated(random),
            Form::Json(value) => json::mutated(value, random),
            Form::Tensors(tensors) => tensors.mutated(random),
            Form::Text(text) => {
                text.mutate(&mut bytes, random);
                bytes
            }
        }
    }
}
