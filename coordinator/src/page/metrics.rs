//! The campaign in Prometheus' text format (exposition format 0.0.4): names with units, counters that end in `_total`.
//!
//! Written by hand from the snapshot: all values are there already, so that a registry would only hold them twice.

use super::parts::steps_per_s;
use super::snapshot::Snapshot;
use crate::seen::{Answer, LATENCY_BOUNDS_S, Seen};
use crate::status::{State, Status};
use runout_proto::identity;
use std::fmt::Write;

/// The content type of what [`text`] gives.
pub(super) const CONTENT_TYPE: &str = "text/plain; version=0.0.4; charset=utf-8";

/// All metrics.
pub(super) fn text(snapshot: &Snapshot) -> String {
    let mut text = Text::default();
    let status = &snapshot.status;
    about(&mut text, snapshot);
    progress(&mut text, snapshot);
    estimates(&mut text, status);
    counters(&mut text, &snapshot.seen);
    latency(&mut text, &snapshot.seen);
    workers(&mut text, snapshot);
    text.0
}

#[derive(Default)]
struct Text(String);

type Labels<'a> = &'a [(&'a str, &'a str)];

impl Text {
    /// Begins a metric.
    fn head(&mut self, name: &str, kind: &str, help: &str) {
        let _ = writeln!(self.0, "# HELP runout_{name} {help}\n# TYPE runout_{name} {kind}");
    }

    /// A value of the metric that was begun.
    fn value(&mut self, name: &str, labels: Labels<'_>, value: f64) {
        let labels: Vec<String> =
            labels.iter().map(|(key, value)| format!("{key}=\"{}\"", escaped(value))).collect();
        let labels = if labels.is_empty() { String::new() } else { format!("{{{}}}", labels.join(",")) };
        // Rust writes a number so that it reads back the same, as the format wants it.
        let _ = writeln!(self.0, "runout_{name}{labels} {value}");
    }

    fn gauge(&mut self, name: &str, help: &str, value: f64) {
        self.head(name, "gauge", help);
        self.value(name, &[], value);
    }

    fn counter(&mut self, name: &str, help: &str, value: u64) {
        self.head(name, "counter", help);
        self.value(name, &[], value as f64);
    }

    /// A value that is not known is left out.
    fn if_known(&mut self, name: &str, help: &str, value: Option<f64>) {
        if let Some(value) = value {
            self.gauge(name, help, value);
        }
    }

    fn interval(&mut self, name: &str, help: &str, interval: Option<[f64; 2]>) {
        if let Some([low, high]) = interval {
            self.head(name, "gauge", help);
            self.value(name, &[("bound", "low")], low);
            self.value(name, &[("bound", "high")], high);
        }
    }
}

/// A label's value: backslash, quote and line feed escaped.
fn escaped(value: &str) -> String {
    value.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n")
}

fn about(text: &mut Text, snapshot: &Snapshot) {
    let status = &snapshot.status;
    text.head("build_info", "gauge", "The coordinator's version and build; always 1.");
    let (version, build) = (env!("CARGO_PKG_VERSION"), identity::build());
    text.value("build_info", &[("version", version), ("build", &build)], 1.0);
    text.head("campaign_info", "gauge", "The campaign's name and the digest of its spec; always 1.");
    text.value("campaign_info", &[("campaign", &status.campaign), ("digest", &status.digest)], 1.0);
    text.head("campaign_state", "gauge", "1 for the campaign's state, 0 for the others.");
    let states = [State::Running, State::Converged, State::Maximum, State::Interrupted, State::Failed];
    for state in states {
        let value = f64::from(u8::from(state == status.state));
        text.value("campaign_state", &[("state", state.name())], value);
    }
    text.gauge("uptime_seconds", "Time since the coordinator started.", snapshot.up.as_secs_f64());
}

fn progress(text: &mut Text, snapshot: &Snapshot) {
    let status = &snapshot.status;
    text.head(
        "realisations_total",
        "counter",
        "Realisations in the estimates by outcome, those of earlier sessions included.",
    );
    for (kind, count) in [("runout", status.samples), ("stable", status.stable), ("failed", status.failed)] {
        text.value("realisations_total", &[("outcome", kind)], count as f64);
    }
    let most = status.maximum_realisations as f64;
    text.gauge("maximum_realisations", "Most realisations that the campaign may take.", most);
    let expected = status.expected_realisations.map(|n| n as f64);
    text.if_known("expected_realisations", "Likely number of realisations at the end.", expected);
    let lag = "Outcomes recorded that wait for one of a lower index before they count.";
    text.gauge("prefix_lag_realisations", lag, status.ahead as f64);
    text.gauge("leases_out", "Realisations given out to workers.", snapshot.leases as f64);
    let rate = status.realisations_per_min.map(|rate| rate / 60.0);
    text.if_known("realisations_per_second", "Recent speed of all workers together.", rate);
    text.if_known("remaining_seconds", "Likely time left.", status.eta_s);
    text.counter("conflicts_total", "Outcomes that contradict a recorded one.", status.conflicts);
    text.counter("audits_agreed_total", "Realisations run twice with the same bits.", status.audits_agreed);
    text.gauge(
        "audits_due",
        "Realisations chosen for a second run that is not done.",
        status.audits_due as f64,
    );
}

fn estimates(text: &mut Text, status: &Status) {
    text.if_known("runout_mean_metres", "Mean runout of the slopes that failed.", status.mean_m);
    text.interval("runout_mean_interval_metres", "Interval of the mean runout.", status.mean_interval_m);
    let sd = "Standard deviation of the runout of the slopes that failed.";
    text.if_known("runout_standard_deviation_metres", sd, status.sd_m);
    text.if_known("failure_probability_ratio", "Share of slopes that failed.", status.p_failure);
    let interval = "Interval of the share of slopes that failed.";
    text.interval("failure_probability_interval_ratio", interval, status.p_failure_interval);
    text.gauge("confidence_ratio", "Confidence level of the intervals.", status.confidence);
    if !status.requirements.is_empty() {
        text.head("stop_requirement_met", "gauge", "1 for what the stopping rule asks for and is met.");
        for r in &status.requirements {
            let met = f64::from(u8::from(r.met));
            text.value("stop_requirement_met", &[("requirement", &r.what)], met);
        }
    }
}

fn counters(text: &mut Text, seen: &Seen) {
    text.head("reports_total", "counter", "Reports of workers by answer, since the coordinator started.");
    let answers = [Answer::Recorded, Answer::Duplicate, Answer::Conflict, Answer::NotWanted, Answer::Refused];
    for answer in answers {
        let count = seen.reports.get(&answer).copied().unwrap_or(0);
        text.value("reports_total", &[("answer", answer.name())], count as f64);
    }
    text.counter("workers_refused_total", "Workers that were not registered.", seen.refused_workers);
    text.counter(
        "workers_lost_total",
        "Workers given up because they were silent or died.",
        seen.lost_workers,
    );
    text.head("realisations_lost_total", "counter", "Attempts that ended without an outcome, by cause.");
    for (cause, count) in [("hung", seen.hung), ("broken", seen.broken)] {
        text.value("realisations_lost_total", &[("cause", cause)], count as f64);
    }
    text.counter(
        "realisations_poisoned_total",
        "Realisations that took several workers down.",
        seen.poisoned,
    );
    text.counter(
        "workers_set_aside_total",
        "Workers that compute other bits than others and get no more leases.",
        seen.set_aside,
    );
    text.counter(
        "outcomes_corrected_total",
        "Outcomes replaced because the one recorded first was overruled.",
        seen.corrected,
    );
}

fn latency(text: &mut Text, seen: &Seen) {
    const NAME: &str = "report_latency_seconds";
    text.head(NAME, "histogram", "Time from the arrival of a report to its durable answer.");
    let mut below = 0;
    for (bound, count) in LATENCY_BOUNDS_S.iter().zip(seen.latency.counts) {
        below += count;
        text.value("report_latency_seconds_bucket", &[("le", &bound.to_string())], below as f64);
    }
    let all: u64 = seen.latency.counts.iter().sum();
    text.value("report_latency_seconds_bucket", &[("le", "+Inf")], all as f64);
    text.value("report_latency_seconds_sum", &[], seen.latency.sum_s);
    text.value("report_latency_seconds_count", &[], all as f64);
}

fn workers(text: &mut Text, snapshot: &Snapshot) {
    let workers = &snapshot.status.workers;
    text.gauge("workers", "Workers registered.", workers.len() as f64);
    let slots: u32 = workers.iter().map(|w| w.slots).sum();
    text.gauge("slots", "Realisations that these can run at a time.", f64::from(slots));
    let mut each = |name: &str, kind: &str, help: &str, value: &dyn Fn(usize) -> f64| {
        if !workers.is_empty() {
            text.head(name, kind, help);
        }
        for (place, worker) in workers.iter().enumerate() {
            text.value(name, &[("worker", &worker.name)], value(place));
        }
    };
    let work = |place: usize| snapshot.seen.work.get(&workers[place].name).copied().unwrap_or_default();
    each("worker_realisations_total", "counter", "Outcomes recorded from a worker.", &|i| {
        work(i).outcomes as f64
    });
    let compute = "Wall time of the outcomes recorded from a worker.";
    each("worker_compute_seconds_total", "counter", compute, &|i| work(i).wall_s);
    each("worker_steps_total", "counter", "Time steps of these outcomes.", &|i| work(i).steps as f64);
    let speed = "Time steps a second of what a worker runs, all slots together.";
    each("worker_steps_per_second", "gauge", speed, &|i| steps_per_s(&workers[i]));
    each("worker_heard_seconds", "gauge", "Time since a worker was last heard of.", &|i| workers[i].heard_s);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_are_escaped() {
        let mut text = Text::default();
        text.value("x", &[("worker", "a\"b\\c\nd")], 1.5);
        assert_eq!(text.0, "runout_x{worker=\"a\\\"b\\\\c\\nd\"} 1.5\n");
    }
}
