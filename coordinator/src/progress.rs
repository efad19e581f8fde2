//! Progress on stderr: a bar on a terminal, plain lines otherwise.

use crate::service::Shared;
use crate::status::Status;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressFinish, ProgressStyle};
use std::io::{self, IsTerminal, Write};
use std::sync::Weak;
use std::time::Duration;
use tokio::time::Instant;

const BAR_PERIOD: Duration = Duration::from_millis(500);
const LINE_PERIOD: Duration = Duration::from_secs(10);
const LOOK_PERIOD: Duration = Duration::from_secs(1);

/// Shows progress until the campaign is closed or the task is aborted.
pub async fn show(shared: Weak<Shared>) {
    if io::stderr().is_terminal() {
        show_bar(&shared).await;
    } else {
        show_lines(&shared).await;
    }
}

async fn show_bar(shared: &Weak<Shared>) {
    let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
    let style = ProgressStyle::with_template("{bar:30} {prefix}\n{wide_msg}").expect("the template is sound");
    // The task is aborted at the end: the summary then says more than the bar.
    let bar = bar.with_style(style).with_finish(ProgressFinish::AndClear);
    let mut period = tokio::time::interval(BAR_PERIOD);
    while let Some(shared) = shared.upgrade() {
        let status = shared.status();
        drop(shared);
        bar.set_length(status.expected_realisations.unwrap_or(status.maximum_realisations));
        bar.set_position(status.realisations);
        bar.set_prefix(status.pace());
        bar.set_message(status.estimate());
        period.tick().await;
    }
}

async fn show_lines(shared: &Weak<Shared>) {
    let mut period = tokio::time::interval(LOOK_PERIOD);
    let mut last: Option<(Instant, Status)> = None;
    while let Some(shared) = shared.upgrade() {
        let status = shared.status();
        drop(shared);
        let due = last.as_ref().is_none_or(|(at, shown)| {
            at.elapsed() >= LINE_PERIOD && shown.realisations != status.realisations
        });
        if due {
            say(&format!("{}; {}\n", status.pace(), status.estimate()));
            last = Some((Instant::now(), status));
        }
        period.tick().await;
    }
}

/// Says `text` to the user on standard error; that nobody can read it is no failure.
pub fn say(text: &str) {
    // There is no better place to complain.
    let _ = io::stderr().lock().write_all(text.as_bytes());
}
