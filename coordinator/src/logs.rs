//! Logs of the coordinator and of the other commands: to standard error, and the latest ones kept for the live page.

use crate::progress::Messages;
use runout_proto::logging::{self, Line, LogFormat};
use std::collections::VecDeque;
use std::io::{self, IsTerminal};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tracing::{Event, Subscriber};
use tracing_subscriber::layer::{Context, Layer, SubscriberExt};
use tracing_subscriber::util::SubscriberInitExt;
use tracing_subscriber::{EnvFilter, Registry};

/// Lines kept.
const KEPT: usize = 40;
/// Characters of a kept line's sentence: a message from a worker may be long.
const LONGEST: usize = 400;

static RECENT: Mutex<VecDeque<Line>> = Mutex::new(VecDeque::new());

/// Sends logs to standard error, at the level of `RUST_LOG` (warnings if it is not set). What goes wrong in sled is
/// said by the store.
pub fn start(format: LogFormat) {
    let filter =
        EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("warn,sled=off,runout=info"));
    let colour = io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|v| v.is_empty());
    let lines = logging::layer::<Registry, _>(format, colour, || Messages);
    // A second call (in tests) changes nothing.
    let _ = tracing_subscriber::registry().with(lines.and_then(Recent).with_filter(filter)).try_init();
}

/// The latest lines, the last one first.
pub fn recent() -> Vec<Line> {
    kept().iter().rev().cloned().collect()
}

fn kept() -> MutexGuard<'static, VecDeque<Line>> {
    RECENT.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Keeps the latest lines.
struct Recent;

impl<S: Subscriber> Layer<S> for Recent {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let mut line = Line::of(event);
        if let Some((end, _)) = line.message.char_indices().nth(LONGEST) {
            line.message.truncate(end);
            line.message.push('\u{2026}');
        }
        let mut kept = kept();
        if kept.len() == KEPT {
            kept.pop_front();
        }
        kept.push_back(line);
    }
}
