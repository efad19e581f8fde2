//! Progress on stderr: a bar on a terminal, plain lines otherwise.

use crate::service::Shared;
use crate::status::Status;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{self, IsTerminal, Write};
use std::sync::{Mutex, MutexGuard, PoisonError, Weak};
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
    bar.set_style(ProgressStyle::with_template("{bar:30} {msg}").expect("the template is sound"));
    let shown = Shown::new(bar);
    let mut period = tokio::time::interval(BAR_PERIOD);
    while let Some(shared) = shared.upgrade() {
        let status = shared.status();
        drop(shared);
        shown.0.set_length(status.expected_realisations.unwrap_or(status.maximum_realisations));
        shown.0.set_position(status.realisations);
        shown.0.set_message(status.lines().join("\n  "));
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
            say(&(status.lines().join("; ") + "\n"));
            last = Some((Instant::now(), status));
        }
        period.tick().await;
    }
}

/// The bar on the terminal, if there is one.
static BAR: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// A bar that goes away with this, also if its task is aborted: the summary then says more.
struct Shown(ProgressBar);

impl Shown {
    fn new(bar: ProgressBar) -> Shown {
        *the_bar() = Some(bar.clone());
        Shown(bar)
    }
}

impl Drop for Shown {
    fn drop(&mut self) {
        the_bar().take();
        self.0.finish_and_clear();
    }
}

fn the_bar() -> MutexGuard<'static, Option<ProgressBar>> {
    BAR.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Standard error, above the bar where there is one.
#[derive(Debug, Clone, Copy)]
pub struct Messages;

impl Write for Messages {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let write = || io::stderr().lock().write(bytes);
        match &*the_bar() {
            Some(bar) => bar.suspend(write),
            None => write(),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().lock().flush()
    }
}

/// Says `text` to the user on standard error; that nobody can read it is no failure.
pub fn say(text: &str) {
    // There is no better place to complain.
    let _ = Messages.write_all(text.as_bytes());
}
