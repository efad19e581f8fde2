//! Where a campaign stands, as people and scripts see it.

pub mod cache;
pub mod tally;
mod text;

pub use text::duration;

use crate::engine::Engine;
use crate::load;
use crate::run_directory::{self, Frame, RunView};
use crate::store::log::Record;
use runout_core::campaign::{Campaign, StopRule};
use runout_core::estimate::rule::Requirement;
use runout_core::estimate::{Decision, Estimate, Estimator};
use runout_core::outcome::Outcome;
use runout_proto::convert::readable;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::Duration;

/// State of a campaign.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum State {
    /// A coordinator works on it.
    Running,
    /// The stopping rule holds.
    Converged,
    /// The maximum number of realisations was reached without it.
    Maximum,
    /// No coordinator works on it, and it is not done: resumable.
    Interrupted,
    /// A failed realisation ended it (`on_failure = "abort"`).
    Failed,
}

impl State {
    /// The state that a decision means; `going_on` for none yet.
    pub fn of(decision: Decision, going_on: State) -> State {
        match decision {
            Decision::Continue => going_on,
            Decision::Converged { .. } => State::Converged,
            Decision::Maximum => State::Maximum,
            Decision::Aborted { .. } => State::Failed,
        }
    }

    /// The name used in JSON.
    pub fn name(self) -> &'static str {
        match self {
            State::Running => "running",
            State::Converged => "converged",
            State::Maximum => "maximum",
            State::Interrupted => "interrupted",
            State::Failed => "failed",
        }
    }

    /// The exit code of a coordinator that ends in this state.
    pub fn exit_code(self) -> u8 {
        match self {
            State::Converged => 0,
            State::Running | State::Failed => 1,
            State::Maximum => 3,
            State::Interrupted => 130,
        }
    }
}

/// Where a campaign stands. Estimates cover the contiguous prefix of realisations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// Name of the campaign.
    pub campaign: String,
    /// Digest of the spec.
    pub digest: String,
    /// State.
    pub state: State,
    /// Realisations in the prefix.
    pub realisations: u64,
    /// Slopes that failed.
    pub samples: u64,
    /// Slopes that stood.
    pub stable: u64,
    /// Analyses that failed.
    pub failed: u64,
    /// Outcomes recorded beyond the prefix.
    pub ahead: u64,
    /// Mean runout of the samples, m.
    pub mean_m: Option<f64>,
    /// Its interval, m.
    pub mean_interval_m: Option<[f64; 2]>,
    /// Variance, m2.
    pub variance_m2: Option<f64>,
    /// Standard deviation, m.
    pub sd_m: Option<f64>,
    /// Share of slopes that failed.
    pub p_failure: Option<f64>,
    /// Its interval.
    pub p_failure_interval: Option<[f64; 2]>,
    /// Confidence level of the intervals.
    pub confidence: f64,
    /// Stopping rule.
    pub rule: StopRule,
    /// What it asks for besides the fewest realisations, and how far that is met.
    pub requirements: Vec<Requirement>,
    /// Fewest realisations.
    pub minimum_realisations: u64,
    /// Most realisations.
    pub maximum_realisations: u64,
    /// Outcomes that contradict a recorded one: any is a reason to distrust a worker.
    pub conflicts: u64,
    /// Realisations that were run twice and gave the same bits.
    pub audits_agreed: u64,
    /// Realisations chosen for that and not yet run twice.
    pub audits_due: u64,
    /// Workers; empty if no coordinator answers.
    pub workers: Vec<WorkerStatus>,
    /// Realisations a minute, from recent wall times and all slots.
    pub realisations_per_min: Option<f64>,
    /// Likely number of realisations at the end, the maximum at most.
    pub expected_realisations: Option<u64>,
    /// Likely time left, s.
    pub eta_s: Option<f64>,
    /// What is damaged in the run directory, in words.
    pub damage: Vec<String>,
}

/// A worker.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WorkerStatus {
    /// Name.
    pub name: String,
    /// Realisations at a time.
    pub slots: u32,
    /// Outcomes recorded from it since the coordinator started.
    pub done: u64,
    /// Time since it was last heard of, s.
    pub heard_s: f64,
    /// Whether it was set aside for a contradicting outcome.
    pub set_aside: bool,
    /// What it runs.
    pub running: Vec<RunningStatus>,
}

/// A realisation that is being run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunningStatus {
    /// Index.
    pub index: u64,
    /// Attempt.
    pub attempt: u32,
    /// Time since it was given out, s.
    pub for_s: f64,
    /// Time steps taken.
    pub steps: u64,
    /// Simulated time, s.
    pub simulated_s: f64,
}

impl Status {
    /// The status that a coordinator sent as JSON; its texts cannot do anything in a terminal.
    ///
    /// # Errors
    /// It is none.
    pub fn from_peer(json: &str) -> Result<Status, serde_json::Error> {
        /// Longest text shown, characters.
        const SHOWN: usize = 500;
        let mut status: Status = serde_json::from_str(json)?;
        let texts = [&mut status.campaign, &mut status.digest];
        let names = status.workers.iter_mut().map(|worker| &mut worker.name);
        let asked = status.requirements.iter_mut().map(|requirement| &mut requirement.what);
        for text in texts.into_iter().chain(names).chain(asked).chain(&mut status.damage) {
            *text = readable(text, SHOWN);
        }
        Ok(status)
    }
}

/// Status of a running coordinator.
pub fn of_engine(campaign: &Campaign, digest: &str, engine: &Engine, now: Duration) -> Status {
    let queue = engine.queue();
    let workers: Vec<WorkerStatus> = queue
        .workers()
        .map(|(id, worker)| WorkerStatus {
            name: worker.name.clone(),
            slots: worker.slots,
            done: worker.done,
            heard_s: now.saturating_sub(worker.heard).as_secs_f64(),
            set_aside: worker.set_aside,
            running: queue
                .leases()
                .filter(|(_, running)| running.worker == id)
                .map(|(lease, running)| RunningStatus {
                    index: lease.index,
                    attempt: lease.attempt,
                    for_s: now.saturating_sub(running.since).as_secs_f64(),
                    steps: running.steps,
                    simulated_s: running.simulated_s,
                })
                .collect(),
        })
        .collect();
    let slots: u32 = workers.iter().map(|w| w.slots).sum();
    let estimator = engine.estimator();
    let mut status = of_estimator(campaign, digest, estimator, State::Running);
    let per_s = queue.mean_duration_s().filter(|s| *s > 0.0 && slots > 0).map(|s| f64::from(slots) / s);
    status.realisations_per_min = per_s.map(|per_s| per_s * 60.0);
    status.eta_s = estimator
        .expected_remaining()
        .zip(per_s)
        .map(|(more, per_s)| more.saturating_sub(engine.ahead()) as f64 / per_s);
    status.ahead = engine.ahead();
    status.conflicts = engine.conflicts();
    status.audits_agreed = engine.audits_agreed();
    status.audits_due = queue.audits_due() as u64;
    status.workers = workers;
    status
}

/// Status from a run directory alone, without a coordinator.
///
/// # Errors
/// It cannot be read, or its campaign file is wrong.
pub fn of_directory(path: &Path) -> anyhow::Result<Status> {
    let frame = run_directory::read_frame(path)?;
    let campaign = campaign_of_frame(&frame, path)?;
    let (tally, damage) = tally::read(path, &cache::key(&frame), &campaign)?;
    let digest = frame.spec.digest();
    let mut status = of_estimator(&campaign, &digest, tally.estimator(), State::Interrupted);
    status.ahead = tally.ahead();
    status.conflicts = tally.conflicts();
    status.audits_agreed = tally.audits_agreed();
    status.audits_due = tally.audits_due();
    status.damage = damage;
    Ok(status)
}

/// The checked campaign of a run directory.
///
/// # Errors
/// Its campaign file is wrong.
pub fn campaign_of(view: &RunView, path: &Path) -> Result<Campaign, load::LoadError> {
    parse_campaign(&view.campaign_text, view.profile_text.as_ref(), path)
}

/// As [`campaign_of`], without the outcomes.
///
/// # Errors
/// As [`campaign_of`].
pub fn campaign_of_frame(frame: &Frame, path: &Path) -> Result<Campaign, load::LoadError> {
    parse_campaign(&frame.campaign_text, frame.profile_text.as_ref(), path)
}

fn parse_campaign(text: &str, profile: Option<&String>, path: &Path) -> Result<Campaign, load::LoadError> {
    let profile = profile.cloned().map(|text| (text, path.join(run_directory::PROFILE_FILE)));
    load::parse(&path.join("campaign.toml"), text, profile.as_ref())
}

/// Folds outcomes in index order, as far as they are contiguous and until the decision to stop.
pub fn fold<'a>(campaign: &Campaign, outcomes: impl Iterator<Item = &'a Outcome>) -> Estimator {
    let mut estimator = Estimator::new(&campaign.stop, &campaign.model.sample, &campaign.run);
    for outcome in outcomes {
        if estimator.decision() != Decision::Continue || estimator.push(outcome).is_err() {
            break;
        }
    }
    estimator
}

/// The results of a campaign: its records in index order, up to the stopping index or the first gap.
pub fn results<'a>(campaign: &Campaign, view: &'a RunView) -> &'a [Record] {
    let realisations = fold(campaign, view.records.iter().map(|r| &r.outcome)).realisations();
    // The prefix is at most as long as the records.
    &view.records[..realisations as usize]
}

fn of_estimator(campaign: &Campaign, digest: &str, estimator: &Estimator, going_on: State) -> Status {
    let Estimate {
        realisations,
        samples,
        stable,
        failed,
        confidence,
        mean_m,
        mean_interval_m,
        variance_m2,
        sd_m,
        p_failure,
        p_failure_interval,
        ..
    } = estimator.estimate();
    Status {
        campaign: campaign.name.clone(),
        digest: digest.to_owned(),
        state: State::of(estimator.decision(), going_on),
        realisations,
        samples,
        stable,
        failed,
        ahead: 0,
        mean_m,
        mean_interval_m,
        variance_m2,
        sd_m,
        p_failure,
        p_failure_interval,
        confidence,
        rule: campaign.stop.rule.clone(),
        requirements: estimator.requirements(),
        minimum_realisations: campaign.stop.minimum_realisations,
        maximum_realisations: campaign.stop.maximum_realisations,
        conflicts: 0,
        audits_agreed: 0,
        audits_due: 0,
        workers: Vec::new(),
        realisations_per_min: None,
        expected_realisations: estimator.expected_remaining().map(|more| realisations + more),
        eta_s: None,
        damage: Vec::new(),
    }
}
