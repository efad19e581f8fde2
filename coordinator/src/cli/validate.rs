//! `runout validate`: the validation suite on this machine.

use super::{DONE, Failure, print, print_json, say, write_asked};
use crate::validation::{Ran, draw, page, run, table, verdict};
use clap::Args;
use runout_core::gimp::Kernel;
use runout_core::validation::{Case, Check, Comparison, Depth, cases};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// `runout validate [CASE]... [--full] [--out DIR] [--json]`
#[derive(Debug, Args)]
pub struct ValidateArguments {
    /// Cases to run; all if none is named
    #[arg(value_name = "CASE")]
    names: Vec<String>,
    /// All resolutions and durations: minutes instead of seconds
    #[arg(long)]
    full: bool,
    /// Write validation.html, self-contained, and its figures as SVG and PNG into this directory
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// Exit code if a check fails.
const FAILED: u8 = 1;
/// Likeness (Jaro-Winkler) from which a known name is suggested for an unknown one.
const SUGGESTED_FROM: f64 = 0.7;

/// The names of this document are a contract.
#[derive(Debug, Serialize)]
struct Document<'a> {
    version: &'static str,
    kernel: &'static str,
    full: bool,
    passes: bool,
    cases: Vec<CaseDocument<'a>>,
}

#[derive(Debug, Serialize)]
struct CaseDocument<'a> {
    name: &'static str,
    title: &'static str,
    passes: bool,
    seconds: f64,
    /// Message of the panic that ended it.
    panic: Option<&'a str>,
    checks: Vec<CheckDocument<'a>>,
    notes: &'a [String],
}

#[derive(Debug, Serialize)]
struct CheckDocument<'a> {
    what: &'a str,
    unit: &'static str,
    reference: f64,
    /// Absent (`null`) if it is not a finite number.
    found: f64,
    error: Option<f64>,
    /// `relative`, `absolute`, `at-most`, `at-least` or `information`.
    comparison: &'static str,
    tolerance: Option<f64>,
    verdict: &'static str,
}

pub(super) fn validate(arguments: &ValidateArguments) -> Result<u8, Failure> {
    let chosen = choose(&arguments.names)?;
    if let Some(dir) = &arguments.out {
        std::fs::create_dir_all(dir)
            .map_err(|e| Failure::Input(format!("{}: it cannot be made: {e}", dir.display())))?;
    }
    let depth = if arguments.full { Depth::Full } else { Depth::Quick };
    let mut all = Vec::with_capacity(chosen.len());
    for (k, case) in chosen.iter().enumerate() {
        say(&format!("{} of {}: {}\n", k + 1, chosen.len(), case.name));
        let ran = run(*case, depth);
        if !arguments.json {
            print(&text(&ran))?;
        }
        all.push(ran);
    }
    let passes = all.iter().all(Ran::passes);
    if let Some(dir) = &arguments.out {
        write(dir, &all, depth)?;
    }
    if arguments.json {
        print_json(&Document {
            version: env!("CARGO_PKG_VERSION"),
            kernel: Kernel::best().name(),
            full: arguments.full,
            passes,
            cases: all.iter().map(document).collect(),
        })?;
    } else {
        print(&closing(&all))?;
    }
    Ok(if passes { DONE } else { FAILED })
}

/// The named cases in the suite's order; all if none is named.
fn choose(names: &[String]) -> Result<Vec<Case>, Failure> {
    let known = cases();
    for name in names {
        if !known.iter().any(|c| c.name == name) {
            let likeness = |c: &Case| strsim::jaro_winkler(name, c.name);
            let nearest = known.iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
            let suggestion = nearest
                .filter(|c| likeness(c) > SUGGESTED_FROM)
                .map_or_else(String::new, |c| format!("; did you mean '{}'?", c.name));
            let list: Vec<&str> = known.iter().map(|c| c.name).collect();
            return Err(Failure::Input(format!(
                "there is no case '{name}'{suggestion}\nThe cases are: {}",
                list.join(", ")
            )));
        }
    }
    let wanted = |c: &Case| names.is_empty() || names.iter().any(|n| n == c.name);
    Ok(known.into_iter().filter(wanted).collect())
}

/// Title, table, notes.
fn text(ran: &Ran) -> String {
    let seconds = ran.wall.as_secs_f64();
    let mut text = format!("{} ({}), {seconds:.1} s\n", ran.case.title, ran.case.name);
    match &ran.findings {
        Ok(findings) => {
            text.push_str(&table(&findings.checks).render());
            for note in &findings.notes {
                text.push_str(&format!("note: {note}\n"));
            }
        }
        Err(message) => text.push_str(&format!("FAIL: it panicked: {message}\n")),
    }
    text.push('\n');
    text
}

fn closing(all: &[Ran]) -> String {
    let checks: usize = all.iter().map(|r| r.checks().len()).sum();
    let failed: Vec<&str> = all.iter().filter(|r| !r.passes()).map(|r| r.case.name).collect();
    let seconds: f64 = all.iter().map(|r| r.wall.as_secs_f64()).sum();
    let verdict =
        if failed.is_empty() { "all pass".to_owned() } else { format!("FAIL: {}", failed.join(", ")) };
    format!("{} cases, {checks} checks, {seconds:.1} s: {verdict}\n", all.len())
}

fn write(dir: &Path, all: &[Ran], depth: Depth) -> Result<(), Failure> {
    let drawn: Vec<_> =
        all.iter().map(draw).collect::<Result<_, _>>().map_err(|e| Failure::work(dir.display(), e))?;
    for figure in drawn.iter().flatten() {
        write_asked(&dir.join(format!("{}.svg", figure.name)), figure.svg.as_bytes())?;
        write_asked(&dir.join(format!("{}.png", figure.name)), &figure.png)?;
    }
    let path = dir.join("validation.html");
    write_asked(&path, page(all, &drawn, depth, Kernel::best().name()).as_bytes())?;
    say(&format!("wrote {} and {} figures\n", path.display(), drawn.iter().flatten().count()));
    Ok(())
}

fn document(ran: &Ran) -> CaseDocument<'_> {
    let findings = ran.findings.as_ref();
    CaseDocument {
        name: ran.case.name,
        title: ran.case.title,
        passes: ran.passes(),
        seconds: ran.wall.as_secs_f64(),
        panic: findings.err().map(String::as_str),
        checks: ran.checks().iter().map(check_document).collect(),
        notes: findings.map_or(&[], |f| &f.notes),
    }
}

fn check_document(check: &Check) -> CheckDocument<'_> {
    let (comparison, tolerance) = match check.comparison {
        Comparison::Relative(tolerance) => ("relative", Some(tolerance)),
        Comparison::Absolute(tolerance) => ("absolute", Some(tolerance)),
        Comparison::AtMost => ("at-most", None),
        Comparison::AtLeast => ("at-least", None),
        Comparison::Information => ("information", None),
    };
    CheckDocument {
        what: &check.what,
        unit: check.unit,
        reference: check.reference,
        found: check.found,
        error: check.error(),
        comparison,
        tolerance,
        verdict: verdict(check),
    }
}
