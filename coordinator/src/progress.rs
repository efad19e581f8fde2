//! Progress on stderr: a bar on a terminal, plain lines otherwise.

use crate::shared::Shared;
use crate::status::Status;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{self, IsTerminal, Write};
use std::sync::{Mutex, MutexGuard, PoisonError, Weak};
use std::time::Duration;
use tokio::time::Instant;

const BAR_PERIOD: Duration = Duration::from_millis(500);
const LINE_PERIOD: Duration = Duration::from_secs(10);
const LOOK_PERIOD: Duration = Duration::from_secs(1);
const BAR_COLUMNS: usize = 30;

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
    let template = format!("{{bar:{BAR_COLUMNS}}} {{msg}}");
    bar.set_style(ProgressStyle::with_template(&template).expect("the template is sound"));
    let shown = Shown::new(bar);
    let mut period = tokio::time::interval(BAR_PERIOD);
    while let Some(shared) = shared.upgrade() {
        let status = shared.status();
        drop(shared);
        shown.0.set_length(status.expected_realisations.unwrap_or(status.maximum_realisations));
        shown.0.set_position(status.realisations);
        // Looked up each time: people resize their terminals.
        let (_, columns) = console::Term::stderr().size();
        shown.0.set_message(folded(&status.lines(), columns.into()));
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

/// Lines beside and below the bar, folded between words where the terminal is narrow: lines that it wraps by itself stay
/// behind when the bar is drawn anew.
fn folded(lines: &[String], columns: usize) -> String {
    const INDENT: &str = "\n  ";
    let mut text = String::new();
    // The bar and a space come first.
    let mut used = BAR_COLUMNS + 1;
    for (number, line) in lines.iter().enumerate() {
        if number > 0 {
            text += INDENT;
            used = 2;
        }
        for (place, word) in line.split(' ').enumerate() {
            let width = word.chars().count();
            if place > 0 && used + 1 + width <= columns {
                text.push(' ');
                used += 1;
            } else if place > 0 || used + width > columns {
                text += INDENT;
                used = 2;
            }
            text += word;
            used += width;
        }
    }
    text
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_line_is_wider_than_the_terminal() {
        let lines =
            ["234 of about 400 realisations".to_owned(), "61 runout, 173 stable, 0 failed".to_owned()];
        assert_eq!(folded(&lines, 80), "234 of about 400 realisations\n  61 runout, 173 stable, 0 failed");
        for columns in [20, 33, 40, 61] {
            let text = folded(&lines, columns);
            assert_eq!(
                text.split_whitespace().collect::<Vec<_>>(),
                lines.join(" ").split(' ').collect::<Vec<_>>()
            );
            let mut widths = text.lines().map(|line| line.chars().count());
            assert!(
                columns < BAR_COLUMNS + 1 || widths.next().unwrap() + BAR_COLUMNS < columns,
                "{columns}: {text}"
            );
            assert!(widths.all(|width| width <= columns), "{columns}: {text}");
        }
    }
}
