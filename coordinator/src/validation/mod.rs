//! The validation suite as a user sees it: tables for the terminal, a JSON document, a page with figures.

mod figure;
mod page;

use crate::picture::{PictureError, png, svg};
use crate::table::{Table, significant};
use runout_core::validation::{Case, Check, Comparison, Depth, Findings};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

pub use page::page;

/// A case that has been run.
#[derive(Debug, Clone)]
pub struct Ran {
    /// The case.
    pub case: Case,
    /// What it found, or the message of its panic.
    pub findings: Result<Findings, String>,
    /// Time it took.
    pub wall: Duration,
}

impl Ran {
    /// Whether it ran to its end and every check that can fail passed.
    pub fn passes(&self) -> bool {
        self.findings.as_ref().is_ok_and(Findings::passes)
    }

    /// Its checks; none if it panicked.
    pub fn checks(&self) -> &[Check] {
        self.findings.as_ref().map_or(&[], |f| &f.checks)
    }

    /// Number of checks that failed; a panic is one.
    pub fn failures(&self) -> usize {
        match &self.findings {
            Ok(findings) => findings.checks.iter().filter(|c| !c.passes()).count(),
            Err(_) => 1,
        }
    }
}

/// Runs a case; a panic in it is a finding.
pub fn run(case: Case, depth: Depth) -> Ran {
    let begun = Instant::now();
    let findings = catch_unwind(AssertUnwindSafe(|| (case.run)(depth))).map_err(|payload| {
        let text = payload.downcast_ref::<String>().map(String::as_str);
        text.or_else(|| payload.downcast_ref::<&str>().copied()).unwrap_or("it panicked").to_owned()
    });
    Ran { case, findings, wall: begun.elapsed() }
}

/// Significant digits of reference and found: enough to see a difference of 0.01 %.
const VALUE_DIGITS: i32 = 5;
/// Significant digits of errors and tolerances.
const ERROR_DIGITS: i32 = 2;

/// The checks of a case as a table.
pub fn table(checks: &[Check]) -> Table {
    let mut table = Table::new(["what", "unit", "reference", "found", "error", "tolerance", "verdict"]);
    for check in checks {
        let [reference, found, error, tolerance, verdict] = cells(check);
        table.row([check.what.clone(), check.unit.to_owned(), reference, found, error, tolerance, verdict]);
    }
    table
}

/// Reference, found, error, tolerance and verdict in words.
fn cells(check: &Check) -> [String; 5] {
    let value = |v: f64| significant(v, VALUE_DIGITS);
    let percent = |v: f64| format!("{} %", significant(100.0 * v, ERROR_DIGITS));
    let plain = |v: f64| significant(v, ERROR_DIGITS);
    let (reference, error, tolerance) = match check.comparison {
        Comparison::Relative(tolerance) => (
            value(check.reference),
            check.error().map_or_else(String::new, percent),
            format!("\u{b1}{}", percent(tolerance)),
        ),
        Comparison::Absolute(tolerance) => (
            value(check.reference),
            check.error().map_or_else(String::new, plain),
            format!("\u{b1}{}", plain(tolerance)),
        ),
        Comparison::AtMost => {
            (format!("\u{2264} {}", value(check.reference)), String::new(), "bound".to_owned())
        }
        Comparison::AtLeast => {
            (format!("\u{2265} {}", value(check.reference)), String::new(), "bound".to_owned())
        }
        Comparison::Information => {
            (value(check.reference), check.error().map_or_else(String::new, percent), String::new())
        }
    };
    [reference, value(check.found), error, tolerance, verdict(check).to_owned()]
}

/// `pass`, `FAIL`, or `info` for what cannot fail.
pub fn verdict(check: &Check) -> &'static str {
    match (check.comparison, check.passes()) {
        (Comparison::Information, _) => "info",
        (_, true) => "pass",
        (_, false) => "FAIL",
    }
}

/// A figure in both formats.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// Name of its files without extension: case and figure.
    pub name: String,
    /// Caption.
    pub title: String,
    /// SVG text with the title.
    pub svg: String,
    /// The same without it, for a page that has captions.
    pub embedded: String,
    /// Bytes of the PNG file.
    pub png: Vec<u8>,
}

/// The figures of a case.
///
/// # Errors
/// A figure cannot be drawn.
pub fn draw(ran: &Ran) -> Result<Vec<Drawn>, PictureError> {
    let figures = ran.findings.as_ref().map_or(&[][..], |f| &f.figures);
    figures
        .iter()
        .map(|figure| {
            let picture = figure::Picture { figure, titled: true };
            let untitled = figure::Picture { figure, titled: false };
            Ok(Drawn {
                name: format!("{}-{}", ran.case.name, figure.name),
                title: figure.title.clone(),
                svg: svg(&picture)?,
                embedded: svg(&untitled)?,
                png: png(&picture)?,
            })
        })
        .collect()
}
