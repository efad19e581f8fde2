//! Where a campaign stands, in words: a line for the progress, some for `runout status`, a summary at the end.

use super::{State, Status, WorkerStatus};
use std::path::Path;

impl Status {
    /// A few short lines for a progress display: how far it is, how fast it goes, what is known, what is wanted.
    pub fn lines(&self) -> Vec<String> {
        let running = self.state == State::Running;
        let mut lines = vec![self.extent()];
        if running {
            lines.push(self.pace());
        }
        let mut known = format!("{} runout, {} stable, {} failed", self.samples, self.stable, self.failed);
        if let Some(p) = self.p_failure {
            known += &format!("; p(failure) {p:.3}{}", within(self.p_failure_interval, ""));
        }
        lines.push(known);
        if let Some(mean) = self.mean_m {
            lines.push(format!("mean runout {mean:.3} m{}", within(self.mean_interval_m, " m")));
        }
        let wanted: Vec<String> = self
            .requirements
            .iter()
            .filter(|r| running && !r.met && r.now.is_some())
            .map(|r| format!("{} {} (asked {})", r.what, value(r.now), number(r.target)))
            .collect();
        if !wanted.is_empty() {
            lines.push(wanted.join(", "));
        }
        lines
    }

    fn extent(&self) -> String {
        let most = self.maximum_realisations;
        match self.expected_realisations.filter(|_| self.state == State::Running) {
            Some(expected) if expected < most => {
                format!("{} of about {expected} realisations", self.realisations)
            }
            _ => format!("{} of at most {most} realisations", self.realisations),
        }
    }

    fn pace(&self) -> String {
        let slots: u32 = self.workers.iter().map(|w| w.slots).sum();
        let mut line = match (slots, self.realisations_per_min) {
            (0, _) => "no worker yet".to_owned(),
            (_, None) => format!("{slots} at a time"),
            (_, Some(rate)) if rate < 10.0 => format!("{slots} at a time, {rate:.1} a minute"),
            (_, Some(rate)) => format!("{slots} at a time, {rate:.0} a minute"),
        };
        if let Some(eta) = self.eta_s {
            line += &format!(", about {} left", duration(eta));
        }
        line
    }

    /// Several lines for people.
    pub fn text(&self) -> String {
        let mut text = format!("{}: {}\n  {}\n", self.campaign, self.state.name(), self.extent());
        if self.state == State::Running {
            text += &format!("  {}\n", self.pace());
        }
        text += &self.findings();
        for worker in &self.workers {
            text += &worker.text();
        }
        text
    }

    /// What came out, where it is and what to do next, when a coordinator ends with the campaign in `dir`.
    pub fn summary(&self, dir: &Path) -> String {
        let realisations = self.realisations;
        let how = match self.state {
            State::Converged => {
                format!("converged after {realisations} realisations: the stopping rule holds")
            }
            State::Maximum => format!(
                "stopped at the maximum of {realisations} realisations; the stopping rule does not hold"
            ),
            State::Failed => format!(
                "ended by a failed analysis, realisation {}, because the campaign says on_failure = \"abort\"",
                realisations.saturating_sub(1)
            ),
            State::Interrupted | State::Running => {
                format!("interrupted after {realisations} realisations; nothing that was recorded is lost")
            }
        };
        let dir = dir.display();
        let next = match self.state {
            State::Interrupted | State::Running => "run the same command again to continue".to_owned(),
            State::Failed => format!("see what failed with `runout results {dir}`"),
            State::Maximum => format!(
                "`runout report {dir}` shows them; to go on, raise stop.maximum_realisations and run the same \
                 command again"
            ),
            State::Converged => {
                format!(
                    "`runout report {dir}` makes a page of them, `runout results {dir}` prints every outcome"
                )
            }
        };
        let findings = self.findings();
        format!("{}: {how}\n{findings}  the results are in {dir}; next: {next}\n", self.campaign)
    }

    /// The estimates and what is remarkable about them.
    fn findings(&self) -> String {
        let percent = self.confidence * 100.0;
        let mut text = format!(
            "  {} slopes failed (samples of runout), {} stood, {} analyses failed\n",
            self.samples, self.stable, self.failed
        );
        if let Some(mean) = self.mean_m {
            text += &format!("  mean runout {mean:.3} m{}", within(self.mean_interval_m, " m"));
            text += &self.sd_m.map_or(String::new(), |sd| format!(", standard deviation {sd:.3} m"));
            text += "\n";
        }
        if let Some(p) = self.p_failure {
            let interval = within(self.p_failure_interval, "");
            text += &format!("  probability of failure {p:.3}{interval}; intervals at {percent} %\n");
        }
        for r in &self.requirements {
            let now = value(r.now);
            let met = if r.met { "met" } else { "not met" };
            text += &format!("  stopping rule: {} {now}, asked {}: {met}\n", r.what, number(r.target));
        }
        if self.audits_agreed + self.audits_due > 0 {
            text += &format!(
                "  audits: {} realisations run twice gave the same bits, {} chosen for it not run twice{}\n",
                self.audits_agreed,
                self.audits_due,
                if self.state == State::Running { " yet" } else { "" }
            );
        }
        if self.conflicts > 0 {
            text += &format!(
                "  WARNING: {} outcomes contradict a recorded one; a worker computes other bits\n",
                self.conflicts
            );
        }
        for note in &self.damage {
            text += &format!("  damage: {note}\n");
        }
        text
    }
}

impl WorkerStatus {
    fn text(&self) -> String {
        let aside = if self.set_aside { ", set aside" } else { "" };
        let mut text = format!(
            "  worker {}: {} slots, {} done, heard {:.0} s ago{aside}\n",
            self.name, self.slots, self.done, self.heard_s
        );
        for running in &self.running {
            text += &format!(
                "    realisation {} (attempt {}): {:.1} s simulated, {} steps, for {}\n",
                running.index,
                running.attempt,
                running.simulated_s,
                running.steps,
                duration(running.for_s)
            );
        }
        text
    }
}

/// A time for people.
pub fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match (whole / 3600, whole / 60 % 60, whole % 60) {
        (0, 0, s) => format!("{s} s"),
        (0, m, s) => format!("{m} min {s} s"),
        (h, m, _) => format!("{h} h {m} min"),
    }
}

fn within(interval: Option<[f64; 2]>, unit: &str) -> String {
    interval.map_or(String::new(), |[low, high]| format!(" ({low:.3} to {high:.3}{unit})"))
}

fn value(now: Option<f64>) -> String {
    now.map_or("not known yet".to_owned(), number)
}

/// A number with three digits after the point, or none if it is whole.
fn number(value: f64) -> String {
    if value.fract() == 0.0 { format!("{value}") } else { format!("{value:.3}") }
}
