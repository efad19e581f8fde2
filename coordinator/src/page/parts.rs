//! The page's parts as HTML: each is the content of the element with its name, and is sent again when it has changed.

use super::charts;
use super::live::View;
use super::snapshot::Snapshot;
use crate::report::html::escape;
use crate::seen::Slide;
use crate::status::{State, Status, WorkerStatus, duration};
use runout_proto::logging::Line;
use std::path::Path;

/// Workers listed; the rest is counted.
const MOST_WORKERS: usize = 60;

/// A part of the page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Part {
    /// Name of the element.
    pub(super) name: &'static str,
    /// Its content.
    pub(super) html: String,
}

/// All parts of the page; those of the samples alone are taken from the view before where the samples are the same.
pub(super) fn of(snapshot: &Snapshot, before: Option<&View>, out: &Path) -> Vec<Part> {
    let status = &snapshot.status;
    let same = before.is_some_and(|b| std::sync::Arc::ptr_eq(&b.snapshot.curves, &snapshot.curves));
    let kept = |name: &str| {
        let parts = before.filter(|_| same).into_iter().flat_map(|view| &view.parts);
        parts.filter(|part| part.name == name).map(|part| part.html.clone()).next()
    };
    let confidence = status.confidence;
    let exceedance = kept("exceedance")
        .unwrap_or_else(|| charts::exceedance(&snapshot.curves, status.p_failure, confidence));
    let mean = kept("mean").unwrap_or_else(|| charts::mean(&snapshot.curves, confidence));
    let seen = &snapshot.seen;
    let longest_m = seen.longest.first().and_then(|slide| slide.runout_m).unwrap_or(0.0);
    let latest: Vec<&Slide> = seen.latest.iter().collect();
    let longest: Vec<&Slide> = seen.longest.iter().collect();
    let failures: Vec<&Slide> = seen.failures.iter().collect();
    [
        ("title", title(status)),
        ("name", escape(&status.campaign)),
        ("state", state(status)),
        ("progress", progress(status)),
        ("numbers", numbers(snapshot)),
        ("exceedance", exceedance),
        ("mean", mean),
        ("rule", rule(status)),
        ("workers", workers(status)),
        ("latest", slides("Latest slides", &latest, longest_m)),
        ("longest", slides("Longest slides", &longest, longest_m)),
        ("replay", replay(&longest, out)),
        ("failures", failed(status, &failures)),
        ("log", log(&snapshot.lines)),
        ("announcement", announcement(status)),
    ]
    .map(|(name, html)| Part { name, html })
    .into()
}

fn total(status: &Status) -> u64 {
    status.expected_realisations.unwrap_or(status.maximum_realisations).max(status.realisations).max(1)
}

fn percent_done(status: &Status) -> f64 {
    100.0 * status.realisations as f64 / total(status) as f64
}

fn title(status: &Status) -> String {
    let name = escape(&status.campaign);
    match status.state {
        State::Running => format!("{:.0} % {name}", percent_done(status).floor()),
        state => format!("{} {name}", state.name()),
    }
}

fn state(status: &Status) -> String {
    let words = match status.state {
        State::Running if status.workers.is_empty() => "waiting for workers",
        State::Running => "running",
        State::Converged => "converged: the stopping rule holds",
        State::Maximum => "stopped at the maximum number of realisations, not converged",
        State::Interrupted => "interrupted: run the same command again to continue",
        State::Failed => "ended by a failed analysis",
    };
    format!("<span class=\"state {}\">{words}</span>", status.state.name())
}

fn progress(status: &Status) -> String {
    let (done, total) = (status.realisations, total(status));
    let how_many = match status.expected_realisations {
        Some(expected) if status.state == State::Running && expected < status.maximum_realisations => {
            format!("{done} of about {total} realisations")
        }
        _ if status.state == State::Running => {
            format!("{done} of at most {} realisations", status.maximum_realisations)
        }
        _ => format!("{done} realisations"),
    };
    let (now, most) = if status.state == State::Running { (done, total) } else { (1, 1) };
    format!(
        "<progress id=\"bar\" max=\"{most}\" value=\"{now}\">{:.0} %</progress><label for=\"bar\">{how_many}</label>",
        percent_done(status).floor()
    )
}

fn numbers(snapshot: &Snapshot) -> String {
    let status = &snapshot.status;
    let unknown = || "not known yet".to_owned();
    let range = |interval: Option<[f64; 2]>, unit: &str| match interval {
        Some([low, high]) => format!("{low:.3} to {high:.3}{unit} ({:.0}\u{a0}%)", 100.0 * status.confidence),
        None => unknown(),
    };
    let rate = match status.realisations_per_min {
        Some(rate) if rate < 10.0 => format!("{rate:.1} / min"),
        Some(rate) => format!("{rate:.0} / min"),
        None => "\u{2013}".to_owned(),
    };
    let slots: u32 = status.workers.iter().map(|w| w.slots).sum();
    let left = match (status.state, status.eta_s) {
        (State::Running, Some(eta)) => format!("about {} left", duration(eta)),
        (State::Running, None) => "time left not known yet".to_owned(),
        _ => "done".to_owned(),
    };
    let ahead = match status.ahead {
        0 => String::new(),
        ahead => format!("; {ahead} more wait for an earlier one"),
    };
    let metres = |value: Option<f64>| value.map_or("\u{2013}".to_owned(), |v| format!("{v:.3} m"));
    let tiles = [
        ("mean runout", metres(status.mean_m), range(status.mean_interval_m, " m")),
        ("standard deviation", metres(status.sd_m), format!("of {} slides", status.samples)),
        (
            "probability of failure",
            status.p_failure.map_or("\u{2013}".to_owned(), |p| format!("{p:.3}")),
            range(status.p_failure_interval, ""),
        ),
        (
            "outcomes",
            format!("{} / {} / {}", status.samples, status.stable, status.failed),
            format!("slid, stood, failed to compute{ahead}"),
        ),
        ("speed", rate, left),
        (
            "workers",
            status.workers.len().to_string(),
            format!("{slots} slots, {} realisations running", snapshot.leases),
        ),
    ];
    let tile = |(name, value, note): &(&str, String, String)| {
        format!("<div><dt>{name}</dt><dd><b>{value}</b><span>{note}</span></dd></div>")
    };
    tiles.iter().map(tile).collect()
}

fn rule(status: &Status) -> String {
    let rows: String = status
        .requirements
        .iter()
        .map(|r| {
            let now = r.now.map_or("not known yet".to_owned(), |v| format!("{v:.4}"));
            let met = if r.met { "met" } else { "not met" };
            format!(
                "<tr><th scope=\"row\">{}</th><td>{now}</td><td>{}</td><td>{met}</td></tr>",
                escape(&r.what),
                r.target
            )
        })
        .collect();
    let least = status.minimum_realisations;
    format!(
        "<caption>The stopping rule, from {least} to {} realisations</caption><thead><tr><th scope=\"col\">asked for</th>\
         <th scope=\"col\">now</th><th scope=\"col\">goal</th><th scope=\"col\"></th></tr></thead><tbody>{rows}</tbody>",
        status.maximum_realisations
    )
}

fn workers(status: &Status) -> String {
    if status.workers.is_empty() {
        return "<caption>No worker is connected.</caption>".to_owned();
    }
    let rows: String = status.workers.iter().take(MOST_WORKERS).map(worker).collect();
    let more = match status.workers.len().saturating_sub(MOST_WORKERS) {
        0 => String::new(),
        more => format!("<tfoot><tr><td colspan=\"6\">and {more} more</td></tr></tfoot>"),
    };
    format!(
        "<caption>Workers</caption><thead><tr><th scope=\"col\">worker</th><th scope=\"col\">slots</th>\
         <th scope=\"col\">recorded</th><th scope=\"col\" class=\"text\">running</th><th scope=\"col\">steps/s</th>\
         <th scope=\"col\">heard</th></tr></thead><tbody>{rows}</tbody>{more}"
    )
}

fn worker(worker: &WorkerStatus) -> String {
    let running: Vec<String> = worker
        .running
        .iter()
        .take(4)
        .map(|r| {
            let again = if r.attempt > 1 { format!(", attempt {}", r.attempt) } else { String::new() };
            format!("{} ({:.1} s simulated{again})", r.index, r.simulated_s)
        })
        .collect();
    let mut running = running.join(", ");
    if worker.running.len() > 4 {
        running += &format!(" and {} more", worker.running.len() - 4);
    }
    let aside = if worker.set_aside { " <em class=\"bad\">set aside</em>" } else { "" };
    format!(
        "<tr><th scope=\"row\">{}{aside}</th><td>{}</td><td>{}</td><td class=\"text\">{running}</td><td>{:.0}</td>\
         <td>{} ago</td></tr>",
        escape(&worker.name),
        worker.slots,
        worker.done,
        steps_per_s(worker),
        duration(worker.heard_s)
    )
}

/// Time steps a second of what a worker runs, all slots together.
pub(super) fn steps_per_s(worker: &WorkerStatus) -> f64 {
    worker.running.iter().filter(|r| r.for_s > 0.0).map(|r| r.steps as f64 / r.for_s).sum()
}

fn slides(caption: &str, slides: &[&Slide], longest_m: f64) -> String {
    if slides.is_empty() {
        return format!("<caption>{caption}: none yet</caption>");
    }
    let rows: String = slides.iter().map(|slide| row(slide, longest_m)).collect();
    format!(
        "<caption>{caption}</caption><thead><tr><th scope=\"col\">realisation</th><th scope=\"col\">runout (m)</th>\
         <td aria-hidden=\"true\"></td><th scope=\"col\">toe advance (m)</th><th scope=\"col\" class=\"text\">ended</th>\
         </tr></thead><tbody>{rows}</tbody>"
    )
}

fn row(slide: &Slide, longest_m: f64) -> String {
    let metres = |value: Option<f64>| value.map_or("\u{2013}".to_owned(), |v| format!("{v:.2}"));
    let share = slide.runout_m.filter(|_| longest_m > 0.0).map_or(0.0, |r| 100.0 * r / longest_m);
    format!(
        "<tr><th scope=\"row\">{}</th><td>{}</td><td class=\"bar\" aria-hidden=\"true\"><svg viewBox=\"0 0 100 8\" \
         preserveAspectRatio=\"none\"><rect width=\"{share:.1}\" height=\"8\"/></svg></td><td>{}</td>\
         <td class=\"text\">{}</td></tr>",
        slide.index,
        metres(slide.runout_m),
        metres(slide.toe_advance_m),
        slide.remark
    )
}

fn replay(longest: &[&Slide], out: &Path) -> String {
    let index = longest.first().map_or("INDEX".to_owned(), |slide| slide.index.to_string());
    format!(
        "To see a slide, run it again from its seed: <code>runout replay {} {index} --out slide-{index}</code>",
        escape(&out.display().to_string())
    )
}

fn failed(status: &Status, failures: &[&Slide]) -> String {
    if failures.is_empty() {
        return "<caption>No analysis has failed.</caption>".to_owned();
    }
    let rows: String = failures
        .iter()
        .map(|f| {
            format!(
                "<tr><th scope=\"row\">{}</th><td class=\"text\">{}</td><td class=\"text\">{}</td><td>{}</td></tr>",
                f.index,
                f.remark,
                escape(&f.worker),
                f.attempt
            )
        })
        .collect();
    format!(
        "<caption>Failed analyses: {} in the estimates' range, the latest below</caption><thead><tr>\
         <th scope=\"col\">realisation</th><th scope=\"col\" class=\"text\">why</th><th scope=\"col\" class=\"text\">worker</th>\
         <th scope=\"col\">attempt</th></tr></thead><tbody>{rows}</tbody>",
        status.failed
    )
}

fn log(lines: &[Line]) -> String {
    if lines.is_empty() {
        return "<li class=\"empty\">Nothing was logged.</li>".to_owned();
    }
    let line = |line: &Line| {
        // The date is that of today, or the reader knows; the seconds are enough.
        let clock = line.time.get(11..19).unwrap_or(&line.time);
        let level = line.level.to_lowercase();
        format!(
            "<li><time datetime=\"{}\">{clock}</time> <b class=\"{level}\">{level}</b> {}</li>",
            escape(&line.time),
            escape(&line.message)
        )
    };
    lines.iter().map(line).collect()
}

/// What a screen reader says of itself: only now and then something else.
fn announcement(status: &Status) -> String {
    match status.state {
        State::Running => {
            format!("Running, {:.0} percent done.", 10.0 * (percent_done(status) / 10.0).floor())
        }
        state => format!("The campaign has ended: {}.", state.name()),
    }
}
