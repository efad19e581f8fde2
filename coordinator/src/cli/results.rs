//! `runout results`: every outcome in index order, as CSV or JSON.
//!
//! What depends on the machine or on luck (attempt, worker, wall_s) stands last: without those columns two campaigns of
//! the same spec are byte-identical. Numbers are in their shortest form that reads back to the same bits.

use super::{Failure, print, print_json, run_records::RunRecords};
use crate::store::log::Record;
use clap::{Args, ValueEnum};
use serde::Serialize;
use std::path::PathBuf;

/// `runout results DIR [--format csv|json]`
#[derive(Debug, Args)]
pub struct ResultsArguments {
    /// Run directory
    dir: PathBuf,
    /// Format of the table
    #[arg(long, value_enum, default_value = "csv")]
    format: Format,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Format {
    /// Comma-separated values with a header line
    Csv,
    /// One JSON array of objects
    Json,
}

/// One row; the order of the fields is the order of the columns.
#[derive(Debug, Serialize)]
struct Row<'a> {
    index: u64,
    outcome: &'static str,
    max_displacement_m: Option<f64>,
    displacement_q999_m: Option<f64>,
    toe_advance_m: Option<f64>,
    crest_retreat_m: Option<f64>,
    moved_area_m2: Option<f64>,
    deposit_height_at_toe_m: Option<f64>,
    time_to_rest_s: Option<f64>,
    outer_work_j: Option<f64>,
    kinetic_j: Option<f64>,
    elastic_j: Option<f64>,
    pore_water_j: Option<f64>,
    plastic_j: Option<f64>,
    drag_j: Option<f64>,
    contact_j: Option<f64>,
    damping_j: Option<f64>,
    energy_drift: Option<f64>,
    simulated_s: f64,
    steps: u64,
    points: u64,
    reason: &'static str,
    marked: &'static str,
    digest: &'a str,
    attempt: u32,
    worker: &'a str,
    wall_s: f64,
}

const COLUMNS: [&str; 27] = [
    "index",
    "outcome",
    "max_displacement_m",
    "displacement_q999_m",
    "toe_advance_m",
    "crest_retreat_m",
    "moved_area_m2",
    "deposit_height_at_toe_m",
    "time_to_rest_s",
    "outer_work_j",
    "kinetic_j",
    "elastic_j",
    "pore_water_j",
    "plastic_j",
    "drag_j",
    "contact_j",
    "damping_j",
    "energy_drift",
    "simulated_s",
    "steps",
    "points",
    "reason",
    "marked",
    "digest",
    "attempt",
    "worker",
    "wall_s",
];

impl<'a> Row<'a> {
    fn of(record: &'a Record) -> Row<'a> {
        let outcome = &record.outcome;
        let measures = outcome.measures.as_ref();
        let energy = outcome.energy.as_ref();
        Row {
            index: outcome.index,
            outcome: outcome.outcome.name(),
            max_displacement_m: measures.map(|m| m.max_displacement_m),
            displacement_q999_m: measures.map(|m| m.displacement_q999_m),
            toe_advance_m: measures.map(|m| m.toe_advance_m),
            crest_retreat_m: measures.map(|m| m.crest_retreat_m),
            moved_area_m2: measures.map(|m| m.moved_area_m2),
            deposit_height_at_toe_m: measures.map(|m| m.deposit_height_at_toe_m),
            time_to_rest_s: measures.and_then(|m| m.time_to_rest_s),
            outer_work_j: energy.map(|e| e.outer_work_j),
            kinetic_j: energy.map(|e| e.kinetic_j),
            elastic_j: energy.map(|e| e.elastic_j),
            pore_water_j: energy.map(|e| e.pore_water_j),
            plastic_j: energy.map(|e| e.plastic_j),
            drag_j: energy.map(|e| e.drag_j),
            contact_j: energy.map(|e| e.contact_j),
            damping_j: energy.map(|e| e.damping_j),
            energy_drift: energy.map(runout_core::gimp::Energy::drift),
            simulated_s: outcome.simulated_s,
            steps: outcome.steps,
            points: outcome.points,
            reason: outcome.reason.name(),
            marked: outcome.mark(),
            digest: &outcome.digest,
            attempt: record.attempt,
            worker: &record.worker,
            wall_s: record.wall_s,
        }
    }
}

pub(super) fn results(arguments: &ResultsArguments) -> Result<(), Failure> {
    let run = RunRecords::read(&arguments.dir)?;
    run.warn();
    let rows: Vec<Row<'_>> = run.decided().iter().map(Row::of).collect();
    match arguments.format {
        Format::Json => print_json(&rows)?,
        Format::Csv => print(&csv(&rows)?)?,
    }
    Ok(())
}

fn csv(rows: &[Row<'_>]) -> Result<String, Failure> {
    let fault = |e: csv::Error| Failure::work("CSV", e);
    let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(Vec::new());
    // Written apart from the rows, so that a table without rows has its header too.
    writer.write_record(COLUMNS).map_err(fault)?;
    rows.iter().try_for_each(|row| writer.serialize(row)).map_err(fault)?;
    let bytes = writer.into_inner().map_err(|e| Failure::work("CSV", e))?;
    String::from_utf8(bytes).map_err(|e| Failure::work("CSV", e))
}
