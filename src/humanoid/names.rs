//! What a joint's name says.

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Left,
    Right,
}

/// Part of the body that a name may mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Hips,
    Trunk,
    Neck,
    Head,
    Clavicle,
    UpperArm,
    LowerArm,
    Hand,
    UpperLeg,
    LowerLeg,
    Foot,
    Toes,
}

/// A name taken to pieces.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Label {
    pub side: Option<Side>,
    /// The name's words without prefix, side and number, written as one: `upperleg`.
    pub core: String,
    /// It fits no slot: an end, a finger, a helper.
    pub is_foreign: bool,
}

/// Words in the names of joints that fit no slot: fingers, faces, ends, helpers of a rig.
const FOREIGN: [&str; 54] = [
    "thumb",
    "index",
    "middle",
    "ring",
    "pinky",
    "pinkie",
    "little",
    "finger",
    "fingers",
    "carpal",
    "metacarpal",
    "palm",
    "end",
    "tip",
    "top",
    "nub",
    "site",
    "twist",
    "roll",
    "ik",
    "fk",
    "pole",
    "pt",
    "target",
    "ctrl",
    "control",
    "effector",
    "socket",
    "slot",
    "handslot",
    "weapon",
    "prop",
    "attach",
    "eye",
    "eyes",
    "eyebrow",
    "jaw",
    "tongue",
    "hair",
    "ear",
    "tail",
    "breast",
    "cloth",
    "skirt",
    "cape",
    "hat",
    "muscle",
    "helper",
    "share",
    "mesh",
    "geo",
    "camera",
    "light",
    "handle",
];

/// Words that say nothing about the part: prefixes of rigs and kinds of node.
const NOISE: [&str; 27] = [
    "mixamorig",
    "def",
    "org",
    "bip",
    "biped",
    "valve",
    "bind",
    "jnt",
    "joint",
    "bone",
    "character",
    "cc",
    "base",
    "rig",
    "armature",
    "skeleton",
    "sk",
    "drv",
    "b",
    "j",
    "c",
    "m",
    "g",
    "human",
    "bend",
    "stretch",
    "x",
];

/// What the core of a name with a side may mean, with a score: 1 where rigs mean nothing else by it. Below that, chosen so
/// that the more usual meaning wins (`leg` is the shin in more rigs than the thigh), and any name of one meaning beats both.
fn sided(core: &str) -> &'static [(Part, f64)] {
    match core {
        "upleg" | "upperleg" | "legupper" | "legup" | "uleg" | "thigh" | "upperthigh" | "femur" => {
            &[(Part::UpperLeg, 1.0)]
        }
        "足" => &[(Part::UpperLeg, 0.9)],
        "hip" | "hips" => &[(Part::UpperLeg, 0.8)],
        // A joint between the hips and the leg: any better name wins.
        "hipjoint" => &[(Part::UpperLeg, 0.45)],
        "lowerleg" | "leglower" | "lowleg" | "loleg" | "lleg" | "calf" | "shin" | "knee"
        | "tibia" | "crus" | "ひざ" => &[(Part::LowerLeg, 1.0)],
        "leg" => &[
            (Part::LowerLeg, 0.9),
            (Part::UpperLeg, 0.5),
            (Part::Foot, 0.2),
        ],
        "foot" | "ankle" | "足首" => &[(Part::Foot, 1.0), (Part::Toes, 0.2)],
        "toe" | "toes" | "ball" | "forefoot" | "つま先" => &[(Part::Toes, 1.0)],
        "clavicle" | "collar" | "collarbone" | "scapula" | "肩" => &[(Part::Clavicle, 1.0)],
        "shoulder" => &[(Part::Clavicle, 0.9), (Part::UpperArm, 0.6)],
        "upperarm" | "armupper" | "armup" | "uparm" | "uarm" | "humerus" | "腕" => {
            &[(Part::UpperArm, 1.0)]
        }
        "shldr" => &[(Part::UpperArm, 0.9), (Part::Clavicle, 0.5)],
        "arm" => &[
            (Part::UpperArm, 0.9),
            (Part::LowerArm, 0.4),
            (Part::Hand, 0.2),
        ],
        "forearm" | "farm" | "lowerarm" | "armlower" | "lowarm" | "loarm" | "elbow" | "radius"
        | "ulna" | "ひじ" => &[(Part::LowerArm, 1.0)],
        "hand" | "wrist" | "手首" => &[(Part::Hand, 1.0)],
        "fist" => &[(Part::Hand, 0.9)],
        _ => &[],
    }
}

/// What the core of a name without a side means, with a score.
fn central(core: &str) -> Option<(Part, f64)> {
    match core {
        "hips" | "hip" | "pelvis" | "bassin" | "下半身" => Some((Part::Hips, 1.0)),
        "spine" | "chest" | "upperchest" | "torso" | "abdomen" | "thorax" | "waist" | "back"
        | "lowerback" | "upperback" | "body" | "ribcage" | "torse" | "上半身" => {
            Some((Part::Trunk, 1.0))
        }
        "neck" | "cou" | "首" => Some((Part::Neck, 1.0)),
        // Parts of a neck, for rigs without a joint for the whole of it.
        "lowerneck" => Some((Part::Neck, 0.9)),
        "upperneck" => Some((Part::Neck, 0.8)),
        "head" | "skull" | "tête" | "頭" => Some((Part::Head, 1.0)),
        _ => None,
    }
}

impl Label {
    /// Takes a joint's name to pieces. Only what follows a namespace (`:`) or a path (`|`) counts.
    pub fn new(name: &str) -> Label {
        let local = name.rsplit([':', '|']).next().unwrap_or(name);
        let mut side = None;
        let mut core = String::new();
        for word in words(local) {
            // A word may be a side, have one in front or behind, or have none.
            let (found, rest) = split_side(&word);
            match (side, found) {
                (None, Some(found)) => side = Some(found),
                // A name with both sides belongs to neither.
                (Some(one), Some(other)) if one != other => return Label::foreign(),
                _ => {}
            }
            if FOREIGN.contains(&rest) {
                return Label::foreign();
            }
            if !NOISE.contains(&rest) || (rest == "joint" && core == "hip") {
                core.push_str(rest);
            }
        }
        Label {
            side,
            core,
            is_foreign: false,
        }
    }

    fn foreign() -> Label {
        Label {
            side: None,
            core: String::new(),
            is_foreign: true,
        }
    }

    /// How well the name fits `part` on `side`, from 0 to 1.
    pub fn fits(&self, part: Part, side: Option<Side>) -> f64 {
        if self.side != side {
            return 0.0;
        }
        let score = |found: &&(Part, f64)| found.0 == part;
        match side {
            Some(_) => sided(&self.core).iter().find(score).map_or(0.0, |s| s.1),
            None => central(&self.core)
                .filter(|c| c.0 == part)
                .map_or(0.0, |c| c.1),
        }
    }
}

/// Parts whose capitals would be split wrongly behind the letter of a side: `LUArm`, `RFArm`.
const CAPITALS: [&str; 4] = ["uarm", "farm", "uleg", "lleg"];

/// Lower-case words of a name, split at everything that isn't a letter and where a new word is capitalised.
fn words(name: &str) -> Vec<String> {
    let runs = name.split(|c: char| !c.is_alphabetic());
    runs.flat_map(|run| {
        let low = run.to_lowercase();
        let part = low.strip_prefix(['l', 'r']);
        if part.is_some_and(|part| CAPITALS.contains(&part)) {
            vec![low]
        } else {
            humps(run)
        }
    })
    .collect()
}

/// Words of a name in camel case; capitals in a row are one word: `IKFoot` is `ik`, `foot`.
fn humps(name: &str) -> Vec<String> {
    let letters: Vec<char> = name.chars().collect();
    let mut words = vec![String::new()];
    for (i, c) in letters.iter().enumerate() {
        let before = i.checked_sub(1).map(|k| letters[k]);
        let after = letters.get(i + 1);
        // A new word begins at a capital after a small letter, and at the last of several capitals before one.
        let starts = c.is_uppercase()
            && (before.is_some_and(char::is_lowercase)
                || (before.is_some_and(char::is_uppercase)
                    && after.is_some_and(|a| a.is_lowercase())));
        if starts {
            words.push(String::new());
        }
        if let Some(last) = words.last_mut() {
            last.extend(c.to_lowercase());
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

/// Side that a word names, and what is left of the word.
fn split_side(word: &str) -> (Option<Side>, &str) {
    match word {
        "l" | "left" | "lft" | "lf" | "lt" => return (Some(Side::Left), ""),
        "r" | "right" | "rgt" | "rt" => return (Some(Side::Right), ""),
        _ => {}
    }
    for (spelling, side) in [
        ("left", Side::Left),
        ("right", Side::Right),
        ("gauche", Side::Left),
        ("droite", Side::Right),
        ("droit", Side::Right),
        ("左", Side::Left),
        ("右", Side::Right),
    ] {
        if let Some(rest) = word
            .strip_prefix(spelling)
            .or_else(|| word.strip_suffix(spelling))
        {
            return (Some(side), rest);
        }
    }
    // `lthigh`: one letter is taken for a side only before a word that is known to have one.
    for (spelling, side) in [("l", Side::Left), ("r", Side::Right)] {
        if let Some(rest) = word.strip_prefix(spelling)
            && !sided(rest).is_empty()
        {
            return (Some(side), rest);
        }
    }
    (None, word)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn label(name: &str) -> (Option<Side>, String) {
        let label = Label::new(name);
        (label.side, label.core)
    }

    #[test]
    fn spellings_of_many_rigs_say_the_same() {
        for name in [
            "mixamorig:LeftUpLeg",
            "mixamorig_LeftUpLeg",
            "mixamorig1:LeftUpLeg",
            "Armature|LeftUpLeg",
        ] {
            assert_eq!(label(name), (Some(Side::Left), "upleg".into()), "{name}");
        }
        for name in [
            "upperarm.r",
            "UpperArm.R",
            "DEF-upper_arm.R",
            "J_Bip_R_UpperArm",
            "rightUpperArm",
        ] {
            assert_eq!(
                label(name),
                (Some(Side::Right), "upperarm".into()),
                "{name}"
            );
        }
        for name in [
            "lThigh",
            "thigh_l",
            "Bip01 L Thigh",
            "ValveBiped.Bip01_L_Thigh",
            "lthigh",
        ] {
            assert_eq!(label(name), (Some(Side::Left), "thigh".into()), "{name}");
        }
        for (name, core) in [
            ("LHipJoint", "hipjoint"),
            ("lf_thigh", "thigh"),
            ("lt_foot", "foot"),
            ("lThighBend", "thigh"),
            ("thigh_stretch.l", "thigh"),
            ("LUArm", "uarm"),
            ("LFArm", "farm"),
            ("lf_arm", "arm"),
            ("LoLeg_L", "loleg"),
            ("Scapula_L", "scapula"),
            ("hand_gauche", "hand"),
            ("左ひじ", "ひじ"),
            ("左足首", "足首"),
        ] {
            assert_eq!(label(name), (Some(Side::Left), core.into()), "{name}");
        }
        for (name, core) in [
            ("rt_shin", "shin"),
            ("RFArm", "farm"),
            ("foot_droite", "foot"),
            ("右腕", "腕"),
        ] {
            assert_eq!(label(name), (Some(Side::Right), core.into()), "{name}");
        }
        assert_eq!(label("spine_02.x"), (None, "spine".into()));
        assert_eq!(label("RIGHT_KNEE"), (Some(Side::Right), "knee".into()));
    }

    #[test]
    fn ends_fingers_and_helpers_are_no_part() {
        for name in [
            "mixamorig:LeftToe_End",
            "mixamorig:HeadTop_End",
            "LeftHandThumb1",
            "handslot.l",
            "PoleTarget.L",
            "LeftArmTwist",
            "foot_IK.l",
            "index_01_r",
            "LeftEye",
        ] {
            assert_eq!(Label::new(name).core, "", "{name}");
        }
    }

    #[test]
    fn words_that_begin_with_l_or_r_keep_their_letter() {
        assert_eq!(label("root"), (None, "root".into()));
        assert_eq!(label("LowerBack"), (None, "lowerback".into()));
    }
}
