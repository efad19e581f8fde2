//! `runout results`: every outcome in index order, as CSV, JSON or Parquet, and what the columns mean.

use super::{Failure, print, print_json, run_records::RunRecords};
use crate::outcomes::{self, Row, parquet};
use crate::store::write_atomically_with;
use clap::{Args, ValueEnum};
use std::io::{self, BufWriter, IsTerminal, Write};
use std::path::{Path, PathBuf};

/// `runout results DIR [--format csv|json|parquet | --profiles] [--out FILE]`, `runout results --schema`
#[derive(Debug, Args)]
pub struct ResultsArguments {
    /// Run directory
    #[arg(required_unless_present = "schema")]
    dir: Option<PathBuf>,
    /// Format of the table
    #[arg(long, value_enum, default_value = "csv")]
    format: Format,
    /// CSV of deposit depths and highest speeds along the ground instead: a row a realisation and column of the ground
    /// (JSON and Parquet have them as lists)
    #[arg(long, conflicts_with = "format")]
    profiles: bool,
    /// Write the table into this file instead of to standard output
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print, as JSON, what every column is: name, type, unit, meaning, when it is missing
    #[arg(long, conflicts_with_all = ["dir", "format", "profiles", "out"])]
    schema: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// Comma-separated values with a header line
    Csv,
    /// One JSON array of objects
    Json,
    /// Apache Parquet: typed columns, missing values as nulls, the schema in its metadata
    Parquet,
}

pub(super) fn results(arguments: &ResultsArguments) -> Result<(), Failure> {
    let Some(dir) = &arguments.dir else { return print_json(&outcomes::schema()) };
    let to_terminal = arguments.out.is_none() && io::stdout().is_terminal();
    if arguments.format == Format::Parquet && to_terminal {
        let message = "--format parquet is no text: name a file with --out, or redirect standard output";
        return Err(Failure::Input(message.to_owned()));
    }
    let run = RunRecords::read(dir)?;
    run.warn();
    let table = if arguments.profiles { profiles(&run, dir)? } else { table(&run, arguments.format)? };
    match &arguments.out {
        None if arguments.format == Format::Parquet => print_bytes(&table),
        None => print(&String::from_utf8(table).map_err(|e| Failure::work("the table", e))?),
        Some(path) => write_atomically_with(path, |file| file.write_all(&table))
            .map_err(|e| Failure::Input(format!("{}: it cannot be written: {e}", path.display()))),
    }
}

fn table(run: &RunRecords, format: Format) -> Result<Vec<u8>, Failure> {
    let records = run.decided();
    let mut table = Vec::new();
    match format {
        Format::Csv => outcomes::write_csv(records, &mut table).map_err(|e| Failure::work("CSV", e))?,
        Format::Json => {
            let rows: Vec<Row<'_>> = records.iter().map(Row).collect();
            table.extend(super::json_text(&rows)?.into_bytes());
        }
        Format::Parquet => {
            let digest = run.view.spec.digest();
            let origin = parquet::Origin { campaign: &run.loaded.campaign.name, digest: &digest };
            parquet::write(records, origin, &mut table).map_err(|e| Failure::work("Parquet", e))?;
        }
    }
    Ok(table)
}

fn profiles(run: &RunRecords, dir: &Path) -> Result<Vec<u8>, Failure> {
    if !run.view.spec.model.sample.profile {
        let none = "its campaign records no profiles along the ground; those with sample.profile = true do";
        return Err(Failure::Input(format!("{}: {none}", dir.display())));
    }
    let mut table = Vec::new();
    outcomes::write_profiles_csv(run.decided(), &mut table).map_err(|e| Failure::work("CSV", e))?;
    Ok(table)
}

/// A reader that has gone away is no failure, as in [`print()`].
fn print_bytes(bytes: &[u8]) -> Result<(), Failure> {
    let mut out = BufWriter::new(io::stdout().lock());
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => Err(Failure::work("standard output", e)),
        _ => Ok(()),
    }
}
