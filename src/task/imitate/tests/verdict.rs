//! What is said of made-up evaluations.

use crate::task::imitate::verdict::verdict;
use crate::task::{Good, Measure, Performance, Unit, Verdict};

/// The verdict on 32 episodes with these measures, some of which failed.
fn of(survival: f64, error_mm: f64, failed: &[f64]) -> Verdict {
    with(survival, error_mm, failed, &[])
}

/// The same with `more` measures.
fn with(survival: f64, error_mm: f64, failed: &[f64], more: &[Measure]) -> Verdict {
    let measures = [
        Measure::new("survival", "survival", survival)
            .good(Good::High, Unit::Share)
            .enough(0.95),
        Measure::new("mpjpe_local_mm", "body error", error_mm)
            .good(Good::Low, Unit::Millimeters)
            .enough(50.0),
    ];
    let measures = [&measures, more].concat();
    verdict(&Performance {
        episodes: 32,
        measures: &measures,
        failed,
        beyond_reach: &[0.25, 0.28125],
    })
}

#[test]
fn a_verdict_says_what_is_wrong() {
    let all = of(1.0, 20.0, &[]);
    assert!(all.learned && all.text == "learned: it lasts from all 32 start phases");
    let one = of(0.97, 20.0, &[0.4375]);
    assert!(one.learned && one.text == "learned, but it fails from phase 0.44");
    let some = of(0.96, 20.0, &[0.0, 0.03125, 0.5, 0.53125]);
    assert!(
        some.learned
            && some.text == "learned, but it fails from phases 0.00, 0.03, 0.50 and 1 more"
    );
    let beyond = of(1.0, 20.0, &[0.25, 0.28125]);
    assert!(beyond.learned);
    assert_eq!(
        beyond.text,
        "learned: it lasts from all 30 start phases within reach; phases 0.25, 0.28 are beyond reach"
    );
    let more = of(0.96, 20.0, &[0.25, 0.5]);
    assert_eq!(more.text, "learned, but it fails from phase 0.50");
    let loose = of(1.0, 83.4, &[]);
    assert!(
        !loose.learned && loose.text == "not yet learned: it lasts, but its bodies are 83 mm off"
    );
    let short = of(0.152, 20.0, &[0.0]);
    assert!(!short.learned && short.text == "not yet learned: it lasts 15 % of the time");
}

/// What the table marks as missed is not learned.
#[test]
fn every_measure_with_a_bound_has_to_hold_it() {
    let global = |value| {
        Measure::new("mpjpe_global_mm", "body error, global", value)
            .good(Good::Low, Unit::Millimeters)
            .enough(100.0)
    };
    let success = |value| {
        Measure::new("success_mean_0_5", "success", value)
            .good(Good::High, Unit::Share)
            .enough(0.95)
    };
    let all = with(1.0, 20.0, &[], &[success(1.0), global(100.0)]);
    assert!(all.learned, "{all:?}");
    let away = with(1.0, 20.0, &[], &[success(1.0), global(106.9)]);
    assert!(!away.learned);
    assert_eq!(
        away.text,
        "not yet learned: it lasts and keeps the pose, but is 107 mm away from where it should be"
    );
    let fails = with(0.96, 20.0, &[0.0, 0.5], &[success(0.93), global(20.0)]);
    assert!(!fails.learned);
    assert_eq!(
        fails.text,
        "not yet learned: it fails from phases 0.00, 0.50"
    );
    // A measure without a bound, or one that isn't defined, decides nothing.
    let free = Measure::new("foot_skate_m_s", "foot skate", 9.0).good(Good::Low, Unit::Score);
    assert!(with(1.0, 20.0, &[], &[free]).learned);
    let still = Measure::new("angular_momentum_error", "momentum", f64::NAN);
    let still = with(1.0, 20.0, &[], &[still]);
    assert!(
        still.learned && still.text.contains("little to learn"),
        "{still:?}"
    );
}

#[test]
fn what_is_no_number_is_not_enough() {
    assert!(!of(f64::NAN, 20.0, &[]).learned);
    assert!(!of(1.0, f64::NAN, &[]).learned);
    let nothing = Performance {
        episodes: 32,
        measures: &[],
        failed: &[],
        beyond_reach: &[],
    };
    assert!(!verdict(&nothing).learned);
}
