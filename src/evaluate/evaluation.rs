//! An evaluation: episodes from many starts, and what is measured over all of them.

use super::agent::{Agent, EvaluateError};
use super::episode::{check_steps, perform};
use crate::sim::LANES;
use crate::task::{
    Episode, EpisodeStart, Failure, Good, Measure, Performance, Perturbations, StartState, Task,
    Unit, Verdict, mean,
};
use rayon::prelude::*;
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

/// Survival that is good enough: docs/results.md asks it of the hardest skills, and all skills there reach it.
const SURVIVAL: f64 = 0.95;

/// The measure of the episode from the first frame alone.
const FROM_START: &str = "survival_from_start";
/// Share of the starts that have to be within reach for the others to be excused. Chosen.
const MOST: f64 = 0.5;

/// What to evaluate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Episodes, whose start phases are spread evenly from the first frame on.
    pub episodes: usize,
    /// Length of an episode of a case that goes on for ever, seconds; any other is performed to its end.
    pub seconds: f64,
    /// Ranges of disturbances with which every start phase is performed a second time. The number of the phase is the seed.
    pub perturbations: Option<Perturbations>,
}

impl Options {
    /// How many episodes there are in all: from each phase once, or twice where they are disturbed, and one from rest.
    pub(crate) fn performed(&self) -> f64 {
        let passes = 1.0 + f64::from(u8::from(self.perturbations.is_some()));
        self.episodes.max(1) as f64 * passes + 1.0
    }
}

impl Default for Options {
    fn default() -> Self {
        Self {
            episodes: 32,
            seconds: 20.0,
            perturbations: None,
        }
    }
}

/// What an evaluation found. In JSON every measure is a field by its name.
#[derive(Clone, Debug, PartialEq)]
pub struct Evaluation {
    /// Episodes that start in the reference's state.
    pub episodes: usize,
    /// Survival first, then the task's own measures, then the return.
    pub measures: Vec<Measure>,
    /// The episodes that failed.
    pub failures: Vec<FailedEpisode>,
    /// Starts, as shares of all possible ones, that are beyond reach: from there the reference asks for more force than the ground
    /// can give. They are performed and measured like all others, but the verdict leaves them out if most starts are within
    /// reach.
    pub beyond_reach: Vec<f64>,
    /// Survival from the starts within reach; not a number if there are none.
    pub survival_within_reach: f64,
    /// Whether these episodes show that the case is learned, as the task sees it.
    pub verdict: Verdict,
    /// One more episode, from standing still in the rest pose.
    pub from_rest: Disturbed,
    /// The same phases again, disturbed. Where the reference follows an agent that was shoved, errors are measured from there, and
    /// no agent fails by being far from where the reference would have been.
    pub perturbed: Option<Disturbed>,
}

impl Evaluation {
    /// The measure of this name.
    pub fn measure(&self, name: &str) -> Option<f64> {
        find(&self.measures, name)
    }
}

/// Episodes in which the agent has more to do than to perform its task, with the measures that still mean something.
#[derive(Clone, Debug, PartialEq)]
pub struct Disturbed {
    /// How many episodes were performed.
    pub episodes: usize,
    /// As in [`Evaluation::measures`].
    pub measures: Vec<Measure>,
    /// The episodes that failed.
    pub failures: Vec<FailedEpisode>,
}

impl Disturbed {
    /// The measure of this name.
    pub fn measure(&self, name: &str) -> Option<f64> {
        find(&self.measures, name)
    }
}

fn find(measures: &[Measure], name: &str) -> Option<f64> {
    let measure = measures.iter().find(|measure| measure.name == name);
    measure.map(|measure| measure.value)
}

/// An episode that failed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FailedEpisode {
    /// Where it started, as a share of all possible starts.
    pub start: f64,
    /// Seconds before the failure.
    pub survived_s: f64,
    /// Why it failed.
    pub failure: Failure,
}

impl FailedEpisode {
    fn of(episode: &Episode) -> Option<Self> {
        let StartState::Reference(start) = episode.start.state else {
            return None;
        };
        Some(Self {
            start,
            survived_s: episode.survived as f64 / episode.control_hz,
            failure: episode.failure?,
        })
    }
}

/// Performs deterministic episodes of a case from evenly spread phases, and one from rest, and measures them. Episodes run
/// in parallel and are gathered in order.
///
/// # Errors
/// A task of another shape than the agent's, or more steps than can be kept.
pub fn evaluate<A: Agent>(
    agent: &A,
    case: usize,
    options: &Options,
) -> Result<Evaluation, EvaluateError> {
    let count = options.episodes.max(1);
    let duration = agent
        .task()
        .cases()
        .get(case)
        .and_then(|case| case.duration_s);
    let steps = duration.unwrap_or(options.seconds) * agent.task().control_hz();
    check_steps(options.performed() * steps)?;
    let start = |n: usize| StartState::Reference(n as f64 / count as f64);
    let phases = (0..count).map(|n| EpisodeStart::new(case, start(n)));
    let rest = EpisodeStart::new(case, StartState::Rest);
    let disturbed = options.perturbations.into_iter().flat_map(|ranges| {
        (0..count).map(move |n| EpisodeStart {
            disturbance: Some((ranges, n as u64)),
            ..EpisodeStart::new(case, start(n))
        })
    });
    // As many at once as the engine steps together; the order is that of the starts, whatever the number of threads.
    let all: Vec<EpisodeStart> = phases.chain([rest]).chain(disturbed).collect();
    let episodes: Result<Vec<Vec<Episode>>, EvaluateError> = all
        .par_chunks(LANES)
        .map(|starts| perform(agent, starts, options.seconds))
        .collect();
    let episodes: Vec<Episode> = episodes?.into_iter().flatten().collect();
    Ok(gather(agent.task().as_ref(), count, episodes))
}

/// Measures `episodes`: the first `count` are undisturbed, the next one starts from rest, the others are disturbed.
fn gather(task: &dyn Task, count: usize, mut episodes: Vec<Episode>) -> Evaluation {
    let mut rest = episodes.split_off(count);
    let disturbed = rest.split_off(1);
    let more = |episodes: &[Episode]| {
        let measures = measures(task, episodes).into_iter();
        Disturbed {
            episodes: episodes.len(),
            measures: measures.filter(|m| m.holds_disturbed).collect(),
            failures: failures(episodes),
        }
    };
    let (mut measured, failed) = (measures(task, &episodes), failures(&episodes));
    let beyond_reach: Vec<f64> = episodes.iter().filter_map(|e| beyond(task, e)).collect();
    // Those within reach come first, in their order.
    episodes.sort_by_key(|episode| beyond(task, episode).is_some());
    let within = &episodes[..count - beyond_reach.len()];
    let judged = match within.len() as f64 >= MOST * count as f64 {
        true => judge(&mut measured, measures(task, within)),
        false => measured.clone(),
    };
    let starts: Vec<f64> = failed.iter().map(|episode| episode.start).collect();
    let verdict = task.verdict(&Performance {
        episodes: count,
        measures: &judged,
        failed: &starts,
        beyond_reach: &beyond_reach,
    });
    Evaluation {
        episodes: count,
        measures: measured,
        failures: failed,
        survival_within_reach: match within {
            [] => f64::NAN,
            within => mean(within.iter().map(Episode::survival)),
        },
        beyond_reach,
        verdict,
        from_rest: more(&rest),
        perturbed: (!disturbed.is_empty()).then(|| more(&disturbed)),
    }
}

/// Where an episode started, as a share of all possible starts, if that is beyond reach.
fn beyond(task: &dyn Task, episode: &Episode) -> Option<f64> {
    match episode.start.state {
        StartState::Reference(start) => {
            Some(start).filter(|start| task.is_beyond_reach(episode.start.case, *start))
        }
        StartState::Rest => None,
    }
}

/// What counts for the verdict: measures over all starts that are good enough, and for any other the same `within` reach. Where
/// only the latter is good enough, the former needn't be. The first frame counts wherever it is.
fn judge(measured: &mut [Measure], within: Vec<Measure>) -> Vec<Measure> {
    let mut judged = within;
    for (all, within) in measured.iter_mut().zip(&mut judged) {
        if all.is_enough() || all.name == FROM_START {
            *within = *all;
        } else if within.is_enough() {
            all.enough = None;
        }
    }
    judged
}

fn failures(episodes: &[Episode]) -> Vec<FailedEpisode> {
    episodes.iter().filter_map(FailedEpisode::of).collect()
}

/// What is measured of every task, and the task's own measures.
fn measures(task: &dyn Task, episodes: &[Episode]) -> Vec<Measure> {
    let from_start = |e: &&Episode| e.start.state == StartState::Reference(0.0);
    let survival = mean(episodes.iter().map(Episode::survival));
    let first = mean(episodes.iter().filter(from_start).map(Episode::survival));
    let rewards = mean(episodes.iter().map(Episode::normalized_return));
    let mut all = vec![
        Measure::new("survival", "survival", survival)
            .good(Good::High, Unit::Share)
            .enough(SURVIVAL)
            .holding_disturbed(),
        Measure::new(FROM_START, "survival, from the first frame", first)
            .good(Good::High, Unit::Share)
            .enough(SURVIVAL),
    ];
    all.extend(task.measures(episodes));
    all.push(
        Measure::new("normalized_return", "normalised return", rewards)
            .good(Good::High, Unit::Score)
            .holding_disturbed(),
    );
    all
}

/// Writes measures as fields.
fn fields<M: SerializeMap>(
    map: &mut M,
    episodes: usize,
    measures: &[Measure],
    failures: &[FailedEpisode],
) -> Result<(), M::Error> {
    map.serialize_entry("episodes", &episodes)?;
    for measure in measures {
        map.serialize_entry(measure.name, &measure.value)?;
    }
    map.serialize_entry("failures", failures)
}

impl Serialize for Evaluation {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        fields(&mut map, self.episodes, &self.measures, &self.failures)?;
        map.serialize_entry("beyond_reach", &self.beyond_reach)?;
        map.serialize_entry("survival_within_reach", &self.survival_within_reach)?;
        map.serialize_entry("learned", &self.verdict.learned)?;
        map.serialize_entry("verdict", &self.verdict.text)?;
        map.serialize_entry("from_rest", &self.from_rest)?;
        map.serialize_entry("perturbed", &self.perturbed)?;
        map.end()
    }
}

impl Serialize for Disturbed {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        fields(&mut map, self.episodes, &self.measures, &self.failures)?;
        map.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn survival(name: &'static str, value: f64) -> Measure {
        let measure = Measure::new(name, "survival", value);
        measure.good(Good::High, Unit::Share).enough(SURVIVAL)
    }

    /// What is beyond reach excuses, but not the first frame; and nothing is judged worse without it.
    #[test]
    fn starts_beyond_reach_excuse() {
        let mut measured = [
            survival("survival", 0.9),
            survival(FROM_START, 0.5),
            survival("success", 0.96),
            survival("other", 0.8),
        ];
        let within = vec![
            survival("survival", 0.97),
            survival(FROM_START, 1.0),
            survival("success", 0.94),
            survival("other", 0.9),
        ];
        let judged = judge(&mut measured, within);
        let passes: Vec<bool> = judged.iter().map(Measure::is_enough).collect();
        assert_eq!(passes, [true, false, true, false]);
        let values: Vec<f64> = judged.iter().map(|m| m.value).collect();
        assert_eq!(values, [0.97, 0.5, 0.96, 0.9]);
        // The table marks what is missed, and excuses what isn't.
        let bounds: Vec<bool> = measured.iter().map(|m| m.enough.is_some()).collect();
        assert_eq!(bounds, [false, true, true, true]);
    }
}
