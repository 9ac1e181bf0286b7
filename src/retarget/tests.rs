use super::*;
use crate::import;

fn clip(file: &str, take: Option<&str>) -> Option<Clip> {
    let path = format!("{}/../shared/data/{file}", env!("CARGO_MANIFEST_DIR"));
    if !std::path::Path::new(&path).exists() {
        eprintln!("skipped: no test data `{file}`");
        return None;
    }
    let options = import::Options { take: take.map(str::to_owned), ..Default::default() };
    Some(import::load(&path, &options).unwrap_or_else(|e| panic!("{file}: {e}")))
}

#[test]
fn explore() {
    let skeleton = Skeleton::load("humanoid").unwrap();
    for file in ["walk", "kick", "spinkick", "backflip", "run", "cartwheel", "getup_facedown", "crawl", "jump"] {
        let Some(clip) = clip(&format!("deepmimic/humanoid3d_{file}.txt"), None) else { return };
        let done = retarget(&clip, &skeleton, &Options::default()).unwrap();
        let r = &done.report;
        println!(
            "{file:15} {:4} f {:5.1} fps {:?} it {} {:6.0} f/s  kp {:.4} {:.4}  skate {:.4} pen {:.4} {:.4} float {:.4} lim {} cycle {:?} {:.3}",
            r.frames, clip.fps, clip.loop_mode, done.iterations, r.frames as f64 / done.seconds,
            r.keypoint_error_m.mean, r.keypoint_error_m.max, r.foot_skate_m_s, r.penetration_m.mean, r.penetration_m.max,
            r.float_m, r.joint_limit_violations, done.motion.cycle.translation.as_slice(), done.motion.cycle.heading,
        );
    }
}
