use super::*;
use crate::import;

fn clip(file: &str, take: Option<&str>) -> Option<Clip> {
    let path = format!("{}/../shared/data/{file}", env!("CARGO_MANIFEST_DIR"));
    if !std::path::Path::new(&path).exists() {
        eprintln!("skipped: no test data `{file}`");
        return None;
    }
    let options = import::Options {
        take: take.map(str::to_owned),
        ..Default::default()
    };
    Some(import::load(&path, &options).unwrap_or_else(|e| panic!("{file}: {e}")))
}

#[test]
fn explore() {
    let skeleton = Skeleton::load("humanoid").unwrap();
    let names = std::env::var("CLIPS").unwrap_or("deepmimic/humanoid3d_walk.txt".into());
    for name in names.split(',') {
        let (file, take) = name
            .split_once('@')
            .map_or((name, None), |(f, t)| (f, Some(t)));
        let Some(clip) = (if file.ends_with(".clip") {
            Some(Clip::load(file).unwrap())
        } else {
            clip(file, take)
        }) else {
            return;
        };
        let done = match retarget(&clip, &skeleton, &Options::default()) {
            Ok(done) => done,
            Err(e) => {
                println!(
                    "{name}: {e} {:?}",
                    clip.joints.iter().map(|j| &j.name).collect::<Vec<_>>()
                );
                continue;
            }
        };
        let r = &done.report;
        println!(
            "{name:45} {:4}f {:3.0}Hz {:?} it {} {:5.0}f/s kp {:.4} {:.4} skate {:.4} pen {:.4} {:.4} flt {:.4} lim {} cyc {:.3} {:.3} {:.3}",
            r.frames,
            clip.fps,
            clip.loop_mode,
            done.iterations,
            r.frames as f64 / done.seconds,
            r.keypoint_error_m.mean,
            r.keypoint_error_m.max,
            r.foot_skate_m_s,
            r.penetration_m.mean,
            r.penetration_m.max,
            r.float_m,
            r.joint_limit_violations,
            /*p*/ done.motion.cycle.translation.x,
            done.motion.cycle.translation.y,
            done.motion.cycle.heading,
        );
        for p in &r.problems {
            println!("      {}: {}", p.id, p.message);
        }
        if std::env::var("SKATE").is_ok() {
            let m = Model::new(&skeleton);
            for f in 0..r.frames - 1 {
                print!("  {f:3} ");
                for (c, &b) in done.motion.contact_bodies.iter().enumerate() {
                    let place = |f: usize, k: &model::Knob| {
                        done.motion.bodies[f][b] * nalgebra::Point3::from(k.center)
                    };
                    let mut ks: Vec<_> = m.knobs.iter().filter(|k| k.body == b).collect();
                    ks.sort_by(|x, y| {
                        (place(f, x).z - x.radius).total_cmp(&(place(f, y).z - y.radius))
                    });
                    let v = (place(f + 1, ks[0]) - place(f, ks[0])).xy().norm() * clip.fps;
                    print!(
                        " | {} c{} z{:.3} v{:.3}",
                        skeleton.bodies[b].name,
                        u8::from(done.motion.tracks.contact[f][c]),
                        place(f, ks[0]).z - ks[0].radius,
                        v
                    );
                }
                println!();
            }
        }
        if std::env::var("DUMP").is_ok() {
            let b = |s: humanoid::Slot| skeleton.slots[&s];
            use humanoid::Slot::*;
            for f in (0..r.frames).step_by((r.frames / 16).max(1)) {
                let at = |s| {
                    let v = done.motion.bodies[f][b(s)].translation.vector;
                    format!("{:5.2} {:5.2} {:5.2}", v.x, v.y, v.z)
                };
                let knee = |s| {
                    let j = &skeleton.bodies[b(s)].joints[0];
                    done.motion.qpos[f][j.qpos]
                };
                println!(
                    "  {f:3} hips {} lf {} rf {} lh {} rh {} knees {:.2} {:.2} elbows {:.2} {:.2} c {:?}",
                    at(Hips),
                    at(LeftFoot),
                    at(RightFoot),
                    at(LeftHand),
                    at(RightHand),
                    knee(LeftLowerLeg),
                    knee(RightLowerLeg),
                    knee(LeftLowerArm),
                    knee(RightLowerArm),
                    done.motion.tracks.contact[f]
                );
            }
        }
    }
}
