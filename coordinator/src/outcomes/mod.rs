//! The table of outcomes: one row an index, one description of its columns.
//!
//! The description ([`COLUMNS`]) is the only place that knows what a column is called, holds and means; CSV, JSON,
//! Parquet and `runout results --schema` follow from it. What depends on the machine or on luck stands last: without
//! those columns two campaigns of the same spec are byte-identical.

pub mod parquet;

use crate::store::log::Record;
use runout_core::gimp::Energy;
use runout_core::outcome::Measures;
use serde::ser::{Serialize, SerializeStruct, Serializer};

/// A cell. Missing is missing: never 0, NaN or an empty text.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value<'a> {
    /// Words.
    Text(Option<&'a str>),
    /// A whole number from 0.
    Integer(Option<u64>),
    /// A finite number.
    Number(Option<f64>),
}

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// UTF-8 text.
    Text,
    /// Whole numbers from 0, 64 bits.
    Integer,
    /// Double precision; its text is the shortest that reads back to the same bits.
    Number,
}

impl Kind {
    /// The name used in the schema.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Text => "text",
            Kind::Integer => "integer",
            Kind::Number => "number",
        }
    }
}

/// A column.
#[derive(Debug, Clone, Copy)]
pub struct Column {
    /// Name, with the unit at its end.
    pub name: &'static str,
    /// What it holds.
    pub kind: Kind,
    /// Unit; none for names, counts and shares.
    pub unit: Option<&'static str>,
    /// What it means.
    pub meaning: &'static str,
    /// When it is missing; none if it never is.
    pub missing: Option<&'static str>,
    /// Whether it follows from (spec, index); the others depend on machine or luck.
    pub reproducible: bool,
    value: fn(&Record) -> Value<'_>,
}

impl Column {
    /// The cell of a record.
    pub fn value<'a>(&self, record: &'a Record) -> Value<'a> {
        (self.value)(record)
    }
}

const FAILED: Option<&str> = Some("the analysis failed");

const fn text(
    name: &'static str,
    meaning: &'static str,
    missing: Option<&'static str>,
    value: fn(&Record) -> Value<'_>,
) -> Column {
    Column { name, kind: Kind::Text, unit: None, meaning, missing, reproducible: true, value }
}

const fn integer(name: &'static str, meaning: &'static str, value: fn(&Record) -> Value<'_>) -> Column {
    Column { name, kind: Kind::Integer, unit: None, meaning, missing: None, reproducible: true, value }
}

const fn number(
    name: &'static str,
    unit: Option<&'static str>,
    meaning: &'static str,
    missing: Option<&'static str>,
    value: fn(&Record) -> Value<'_>,
) -> Column {
    Column { name, kind: Kind::Number, unit, meaning, missing, reproducible: true, value }
}

const fn of_machine(column: Column) -> Column {
    Column { reproducible: false, ..column }
}

/// The columns, in their order.
pub const COLUMNS: [Column; 27] = [
    integer("index", "Index of the realisation, from 0.", |r| Value::Integer(Some(r.outcome.index))),
    text(
        "outcome",
        "runout: the slope failed, and the campaign's measure is above its threshold (a sample); stable: it \
         stood; failed: the analysis failed.",
        None,
        |r| Value::Text(Some(r.outcome.outcome.name())),
    ),
    number("max_displacement_m", Some("m"), "Largest displacement of any material point.", FAILED, |r| {
        measure(r, |m| m.max_displacement_m)
    }),
    number(
        "displacement_q999_m",
        Some("m"),
        "99.9 % quantile of displacement over the material points.",
        FAILED,
        |r| measure(r, |m| m.displacement_q999_m),
    ),
    number(
        "toe_advance_m",
        Some("m"),
        "Advance of the contiguous material's front beyond the initial toe.",
        FAILED,
        |r| measure(r, |m| m.toe_advance_m),
    ),
    number(
        "crest_retreat_m",
        Some("m"),
        "Distance behind the crest edge to which the ground moved more than the threshold.",
        FAILED,
        |r| measure(r, |m| m.crest_retreat_m),
    ),
    number(
        "moved_area_m2",
        Some("m2"),
        "Area of the section (volume per metre of width) that moved more than the threshold.",
        FAILED,
        |r| measure(r, |m| m.moved_area_m2),
    ),
    number(
        "deposit_height_at_toe_m",
        Some("m"),
        "Height of the deposit above the base level at the initial toe's position.",
        FAILED,
        |r| measure(r, |m| m.deposit_height_at_toe_m),
    ),
    number(
        "time_to_rest_s",
        Some("s"),
        "Time from the start of failure until the material came to rest.",
        Some("the analysis failed, or ended before the material came to rest"),
        |r| Value::Number(r.outcome.measures.and_then(|m| m.time_to_rest_s)),
    ),
    number(
        "outer_work_j",
        Some("J/m"),
        "Work done by weight, buoyancy and external forces, per metre of width.",
        FAILED,
        |r| energy(r, |e| e.outer_work_j),
    ),
    number("kinetic_j", Some("J/m"), "Change of the kinetic energy of skeleton and water.", FAILED, |r| {
        energy(r, |e| e.kinetic_j)
    }),
    number("elastic_j", Some("J/m"), "Change of the elastic energy of the skeleton.", FAILED, |r| {
        energy(r, |e| e.elastic_j)
    }),
    number("pore_water_j", Some("J/m"), "Change of the energy of the compressed pore water.", FAILED, |r| {
        energy(r, |e| e.pore_water_j)
    }),
    number("plastic_j", Some("J/m"), "Plastic work.", FAILED, |r| energy(r, |e| e.plastic_j)),
    number("drag_j", Some("J/m"), "Energy taken by Darcy drag.", FAILED, |r| energy(r, |e| e.drag_j)),
    number(
        "contact_j",
        Some("J/m"),
        "Energy taken by friction and impact at frictional walls and obstacles.",
        FAILED,
        |r| energy(r, |e| e.contact_j),
    ),
    number(
        "damping_j",
        Some("J/m"),
        "Energy taken by damping, decay and filter of velocities, and the relaxation of pore pressure.",
        FAILED,
        |r| energy(r, |e| e.damping_j),
    ),
    number(
        "energy_drift",
        None,
        "What the balance of energy misses, as a share of the energy that there was to turn over; positive if \
         the scheme lost energy.",
        FAILED,
        |r| energy(r, Energy::drift),
    ),
    number("simulated_s", Some("s"), "Time simulated in the failure stage.", None, |r| {
        Value::Number(Some(r.outcome.simulated_s))
    }),
    integer("steps", "Time steps taken in the failure stage.", |r| Value::Integer(Some(r.outcome.steps))),
    integer("points", "Number of material points.", |r| Value::Integer(Some(r.outcome.points))),
    text(
        "reason",
        "Why the analysis ended: at-rest, duration-reached, still-moving; or, of a failed one, non-finite, \
         left-grid, step-limit, bad-material, poison.",
        None,
        |r| Value::Text(Some(r.outcome.reason.name())),
    ),
    text(
        "marked",
        "What a reader must know: still-moving (the runout is a lower bound), energy-drift (the balance of \
         energy drifted beyond the limit), or both joined by +.",
        Some("there is nothing to know"),
        |r| Value::Text(Some(r.outcome.mark()).filter(|mark| !mark.is_empty())),
    ),
    text(
        "digest",
        "BLAKE3 digest of the points' final state and of all columns before: the same on every machine.",
        None,
        |r| Value::Text(Some(&r.outcome.digest)),
    ),
    of_machine(integer(
        "attempt",
        "Attempt that gave the outcome, from 1; 0 if the coordinator gave it up.",
        |r| Value::Integer(Some(u64::from(r.attempt))),
    )),
    of_machine(text("worker", "Worker that ran it.", None, |r| Value::Text(Some(&r.worker)))),
    of_machine(number("wall_s", Some("s"), "Wall time of the computation.", None, |r| {
        Value::Number(Some(r.wall_s))
    })),
];

fn measure(record: &Record, of: impl Fn(&Measures) -> f64) -> Value<'_> {
    Value::Number(record.outcome.measures.as_ref().map(of))
}

fn energy(record: &Record, of: impl Fn(&Energy) -> f64) -> Value<'_> {
    Value::Number(record.outcome.energy.as_ref().map(of))
}

/// The description of the table, for people and programs.
#[derive(Debug, Clone, Copy, serde::Serialize)]
pub struct Schema {
    /// What a row is.
    pub rows: &'static str,
    /// How a missing value is written.
    pub missing: &'static str,
    /// The columns, in their order.
    pub columns: [Description; COLUMNS.len()],
}

/// The description of a column: see [`Column`].
#[derive(Debug, Clone, Copy, serde::Serialize)]
pub struct Description {
    name: &'static str,
    r#type: &'static str,
    unit: Option<&'static str>,
    meaning: &'static str,
    missing: Option<&'static str>,
    reproducible: bool,
}

/// The description of the table.
pub fn schema() -> Schema {
    Schema {
        rows: "one a realisation, in index order, up to the one that decided or the first one missing",
        missing: "null in JSON and Parquet, an empty field in CSV",
        columns: COLUMNS.map(|column| Description {
            name: column.name,
            r#type: column.kind.name(),
            unit: column.unit,
            meaning: column.meaning,
            missing: column.missing,
            reproducible: column.reproducible,
        }),
    }
}

/// A row of the table: a JSON object or a CSV record, in the columns' order.
#[derive(Debug, Clone, Copy)]
pub struct Row<'a>(pub &'a Record);

impl Serialize for Row<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut row = serializer.serialize_struct("Row", COLUMNS.len())?;
        for column in &COLUMNS {
            match column.value(self.0) {
                Value::Text(value) => row.serialize_field(column.name, &value)?,
                Value::Integer(value) => row.serialize_field(column.name, &value)?,
                Value::Number(value) => row.serialize_field(column.name, &value)?,
            }
        }
        row.end()
    }
}

/// Writes the table as CSV with a header line.
///
/// # Errors
/// `out` fails.
pub fn write_csv(records: &[Record], out: impl std::io::Write) -> csv::Result<()> {
    let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(out);
    // Written apart from the rows, so that a table without rows has its header too.
    writer.write_record(COLUMNS.iter().map(|column| column.name))?;
    records.iter().try_for_each(|record| writer.serialize(Row(record)))?;
    Ok(writer.flush()?)
}
