//! Logs, the same from both programs: sentences for people, or one JSON object a line for machines.
//!
//! An event says what happened in a sentence and names what it is about in the fields `worker`, `index` and `attempt`. A
//! process works for one campaign, so that its name is noted once and stands in every JSON line. The sentence holds
//! these already: as text they are left out.

use serde::Serialize;
use serde_json::{Map, Value};
use std::fmt::{self, Debug};
use std::str::FromStr;
use std::sync::OnceLock;
use tracing::field::{Field, Visit};
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::fmt::format::{self, Writer};
use tracing_subscriber::fmt::time::{FormatTime, SystemTime};
use tracing_subscriber::fmt::{FmtContext, FormatEvent, FormatFields, MakeWriter};
use tracing_subscriber::registry::LookupSpan;

/// Fields that say what an event is about; its sentence says the same.
const ABOUT: [&str; 4] = ["worker", "index", "attempt", "slots"];

static CAMPAIGN: OnceLock<String> = OnceLock::new();

/// How logs are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LogFormat {
    /// A sentence a line, for people.
    #[default]
    Text,
    /// A JSON object a line, for machines.
    Json,
}

impl FromStr for LogFormat {
    type Err = String;

    fn from_str(text: &str) -> Result<LogFormat, String> {
        match text {
            "text" => Ok(LogFormat::Text),
            "json" => Ok(LogFormat::Json),
            _ => Err("it must be text or json".to_owned()),
        }
    }
}

/// Notes the campaign that this process works for: its name, or its spec's digest where the name is not known. The first
/// call counts.
pub fn belongs_to(campaign: &str) {
    CAMPAIGN.get_or_init(|| campaign.to_owned());
}

/// A layer that writes logs in `format` to `writer`, as text with `colour`.
pub fn layer<S, W>(format: LogFormat, colour: bool, writer: W) -> Box<dyn Layer<S> + Send + Sync>
where
    S: Subscriber + for<'span> LookupSpan<'span>,
    W: for<'writer> MakeWriter<'writer> + Send + Sync + 'static,
{
    let sentence = format::debug_fn(|writer, field, value| match field.name() {
        "message" => write!(writer, "{value:?}"),
        name if ABOUT.contains(&name) => Ok(()),
        name => write!(writer, " {name}={value:?}"),
    });
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(writer)
        .with_ansi(colour && format == LogFormat::Text)
        .with_target(false)
        // A reader of standard error that has gone away is no reason to panic.
        .log_internal_errors(false)
        .fmt_fields(sentence);
    match format {
        LogFormat::Text => Box::new(lines),
        LogFormat::Json => Box::new(lines.event_format(JsonLines)),
    }
}

/// An event, read.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Line {
    /// When, UTC, in ISO 8601.
    pub time: String,
    /// How grave: `ERROR`, `WARN`, `INFO`, `DEBUG` or `TRACE`.
    pub level: &'static str,
    /// The module it comes from.
    pub target: String,
    /// What happened.
    pub message: String,
    /// The campaign; absent until it is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub campaign: Option<String>,
    /// What it is about.
    #[serde(flatten)]
    pub fields: Map<String, Value>,
}

impl Line {
    /// Reads an event, now.
    pub fn of(event: &Event<'_>) -> Line {
        let mut time = String::new();
        // Writing to a string cannot fail.
        let _ = SystemTime.format_time(&mut Writer::new(&mut time));
        let mut read = Read::default();
        event.record(&mut read);
        let metadata = event.metadata();
        Line {
            time,
            level: name_of(*metadata.level()),
            target: metadata.target().to_owned(),
            message: read.message,
            campaign: CAMPAIGN.get().cloned(),
            fields: read.fields,
        }
    }
}

fn name_of(level: Level) -> &'static str {
    match level {
        Level::ERROR => "ERROR",
        Level::WARN => "WARN",
        Level::INFO => "INFO",
        Level::DEBUG => "DEBUG",
        Level::TRACE => "TRACE",
    }
}

#[derive(Default)]
struct Read {
    message: String,
    fields: Map<String, Value>,
}

impl Read {
    fn put(&mut self, field: &Field, value: Value) {
        self.fields.insert(field.name().to_owned(), value);
    }
}

impl Visit for Read {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        match field.name() {
            "message" => self.message = format!("{value:?}"),
            _ => self.put(field, format!("{value:?}").into()),
        }
    }

    fn record_str(&mut self, field: &Field, value: &str) {
        match field.name() {
            "message" => self.message = value.to_owned(),
            _ => self.put(field, value.into()),
        }
    }

    fn record_u64(&mut self, field: &Field, value: u64) {
        self.put(field, value.into());
    }

    fn record_i64(&mut self, field: &Field, value: i64) {
        self.put(field, value.into());
    }

    fn record_bool(&mut self, field: &Field, value: bool) {
        self.put(field, value.into());
    }

    fn record_f64(&mut self, field: &Field, value: f64) {
        self.put(field, value.into());
    }
}

struct JsonLines;

impl<S, N> FormatEvent<S, N> for JsonLines
where
    S: Subscriber + for<'span> LookupSpan<'span>,
    N: for<'writer> FormatFields<'writer> + 'static,
{
    fn format_event(
        &self,
        _: &FmtContext<'_, S, N>,
        mut writer: Writer<'_>,
        event: &Event<'_>,
    ) -> fmt::Result {
        let line = serde_json::to_string(&Line::of(event)).map_err(|_| fmt::Error)?;
        writeln!(writer, "{line}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io;
    use std::sync::{Arc, Mutex};
    use tracing_subscriber::layer::SubscriberExt;

    #[derive(Clone, Default)]
    struct Page(Arc<Mutex<Vec<u8>>>);

    impl io::Write for Page {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().unwrap().write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn written(format: LogFormat) -> String {
        let page = Page::default();
        let to = page.clone();
        let subscriber = tracing_subscriber::registry().with(layer(format, false, move || to.clone()));
        tracing::subscriber::with_default(subscriber, || {
            tracing::warn!(worker = "w \"1\"", index = 7_u64, attempt = 2_u32, left = 3, "worker w lost 7");
        });
        String::from_utf8(page.0.lock().unwrap().clone()).unwrap()
    }

    #[test]
    fn as_text_the_sentence_says_it_once() {
        let line = written(LogFormat::Text);
        assert!(line.ends_with("WARN worker w lost 7 left=3\n"), "{line}");
    }

    #[test]
    fn as_json_every_field_has_its_type() {
        belongs_to("elkhorn");
        let line: Value = serde_json::from_str(&written(LogFormat::Json)).expect("one JSON object");
        assert_eq!(line["message"], "worker w lost 7");
        assert_eq!((&line["campaign"], &line["level"]), (&"elkhorn".into(), &"WARN".into()));
        assert_eq!((&line["worker"], &line["index"]), (&"w \"1\"".into(), &7.into()));
        assert_eq!((&line["attempt"], &line["left"]), (&2.into(), &3.into()));
        assert!(line["time"].as_str().is_some_and(|t| t.ends_with('Z')), "{line}");
        assert!(line["target"].as_str().is_some_and(|t| t.starts_with("runout_proto")), "{line}");
    }
}
