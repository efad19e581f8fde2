//! The table of outcomes: one row an index, one description of its columns.
//!
//! The description ([`COLUMNS`]) is the only place that knows what a column is called, holds and means; CSV, JSON,
//! Parquet and `runout results --schema` follow from it. What depends on the machine or on luck stands last: without
//! those columns two campaigns of the same spec are byte-identical.
//!
//! Profiles along the ground are lists, which CSV has not: there they are a table of their own ([`write_profiles_csv`]).

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
    /// Whole numbers in their order.
    Integers(Option<&'a [u32]>),
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
    /// A list of whole numbers from 0, 32 bits.
    Integers,
}

impl Kind {
    /// The name used in the schema.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Text => "text",
            Kind::Integer => "integer",
            Kind::Number => "number",
            Kind::Integers => "list of integers",
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
    /// Whether it is a part of the profile along the ground, which CSV has in a table of its own.
    pub profile: bool,
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
    Column { name, kind: Kind::Text, unit: None, meaning, missing, reproducible: true, profile: false, value }
}

const fn integer(name: &'static str, meaning: &'static str, value: fn(&Record) -> Value<'_>) -> Column {
    let (kind, unit, missing) = (Kind::Integer, None, None);
    Column { name, kind, unit, meaning, missing, reproducible: true, profile: false, value }
}

const fn number(
    name: &'static str,
    unit: Option<&'static str>,
    meaning: &'static str,
    missing: Option<&'static str>,
    value: fn(&Record) -> Value<'_>,
) -> Column {
    Column { name, kind: Kind::Number, unit, meaning, missing, reproducible: true, profile: false, value }
}

const fn of_profile(
    name: &'static str,
    kind: Kind,
    unit: &'static str,
    meaning: &'static str,
    value: fn(&Record) -> Value<'_>,
) -> Column {
    let missing = Some("the campaign does not record it (sample.profile), or the analysis failed");
    Column { name, kind, unit: Some(unit), meaning, missing, reproducible: true, profile: true, value }
}

const fn of_machine(column: Column) -> Column {
    Column { reproducible: false, ..column }
}

/// The columns, in their order.
pub const COLUMNS: [Column; 30] = [
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
    of_profile(
        "profile_column_m",
        Kind::Number,
        "m",
        "Width of the columns of the profile along the ground, which begin at the toe.",
        |r| Value::Number(r.outcome.profile.as_ref().map(|p| p.column_m)),
    ),
    of_profile(
        "deposit_depth_mm",
        Kind::Integers,
        "mm",
        "Depth of the soil above the original ground at the end, column by column; those after the last that is not 0 are \
         left out.",
        |r| Value::Integers(r.outcome.profile.as_ref().map(|p| p.depth_mm.as_slice())),
    ),
    of_profile(
        "highest_speed_mm_s",
        Kind::Integers,
        "mm/s",
        "Highest speed of that soil at any time, column by column; those after the last that is not 0 are left out.",
        |r| Value::Integers(r.outcome.profile.as_ref().map(|p| p.speed_mm_s.as_slice())),
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
    Value::Number(record.outcome.measures.as_ref().map(|m| unsigned_zero(of(m))))
}

/// Zero without a sign: the area that moved is a sum, and Rust's sum of nothing is -0.0. Its bits are in the digests, so that
/// it is shown otherwise and not kept otherwise.
pub fn unsigned_zero(value: f64) -> f64 {
    value + 0.0
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
    in_csv: bool,
}

/// The description of the table.
pub fn schema() -> Schema {
    Schema {
        rows: "one a realisation, in index order, up to the one that decided or the first one missing",
        missing: "null in JSON and Parquet, an empty field in CSV; lists are not in CSV, which has a table of its own for them \
                  (runout results DIR --profiles)",
        columns: COLUMNS.map(|column| Description {
            name: column.name,
            r#type: column.kind.name(),
            unit: column.unit,
            meaning: column.meaning,
            missing: column.missing,
            reproducible: column.reproducible,
            in_csv: !column.profile,
        }),
    }
}

/// A row of the table as a JSON object, in the columns' order.
#[derive(Debug, Clone, Copy)]
pub struct Row<'a>(pub &'a Record);

impl Serialize for Row<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serialize(self.0, COLUMNS.iter(), serializer)
    }
}

/// A row of the table as a CSV record.
struct FlatRow<'a>(&'a Record);

impl Serialize for FlatRow<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serialize(self.0, flat_columns(), serializer)
    }
}

/// The columns that CSV has.
fn flat_columns() -> impl Iterator<Item = &'static Column> {
    COLUMNS.iter().filter(|column| !column.profile)
}

fn serialize<S: Serializer>(
    record: &Record,
    columns: impl Iterator<Item = &'static Column>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let mut row = serializer.serialize_struct("Row", COLUMNS.len())?;
    for column in columns {
        match column.value(record) {
            Value::Text(value) => row.serialize_field(column.name, &value)?,
            Value::Integer(value) => row.serialize_field(column.name, &value)?,
            Value::Number(value) => row.serialize_field(column.name, &value)?,
            Value::Integers(value) => row.serialize_field(column.name, &value)?,
        }
    }
    row.end()
}

/// Writes the table as CSV with a header line.
///
/// # Errors
/// `out` fails.
pub fn write_csv(records: &[Record], out: impl std::io::Write) -> csv::Result<()> {
    let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(out);
    // Written apart from the rows, so that a table without rows has its header too.
    writer.write_record(flat_columns().map(|column| column.name))?;
    records.iter().try_for_each(|record| writer.serialize(FlatRow(record)))?;
    Ok(writer.flush()?)
}

/// Writes the profiles along the ground as CSV with a header line: a row a realisation and column of the ground, up to the
/// last one that anything passed or came to lie in.
///
/// # Errors
/// `out` fails.
pub fn write_profiles_csv(records: &[Record], out: impl std::io::Write) -> csv::Result<()> {
    let mut writer = csv::Writer::from_writer(out);
    writer.write_record(["index", "from_m", "to_m", "deposit_depth_m", "highest_speed_m_s"])?;
    for record in records {
        let Some(profile) = &record.outcome.profile else { continue };
        for column in 0..profile.depth_mm.len().max(profile.speed_mm_s.len()) {
            let from_m = column as f64 * profile.column_m;
            let along =
                [from_m, from_m + profile.column_m, profile.depth_m(column), profile.speed_m_s(column)];
            writer.serialize((record.outcome.index, along))?;
        }
    }
    Ok(writer.flush()?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::tests::record;
    use runout_core::profile::Profile;

    fn recorded() -> Vec<Record> {
        let mut records: Vec<Record> = (0..3).map(record).collect();
        records[0].outcome.profile = None;
        let empty = Profile { column_m: 0.5, depth_mm: Vec::new(), speed_mm_s: Vec::new() };
        records[1].outcome.profile =
            Some(Profile { depth_mm: vec![1200], speed_mm_s: vec![7000, 250], ..empty.clone() });
        records[2].outcome.profile = Some(empty);
        records
    }

    #[test]
    fn profiles_are_lists_in_json_and_rows_in_csv() {
        let records = recorded();
        let rows = serde_json::to_value(records.iter().map(Row).collect::<Vec<_>>()).unwrap();
        assert!(rows[0]["profile_column_m"].is_null() && rows[0]["deposit_depth_mm"].is_null());
        assert_eq!(rows[1]["deposit_depth_mm"], serde_json::json!([1200]));
        assert_eq!(rows[1]["highest_speed_mm_s"], serde_json::json!([7000, 250]));
        assert_eq!(
            (&rows[2]["profile_column_m"], &rows[2]["deposit_depth_mm"]),
            (&0.5.into(), &serde_json::json!([]))
        );
        let mut csv = Vec::new();
        write_profiles_csv(&records, &mut csv).unwrap();
        let expected =
            "index,from_m,to_m,deposit_depth_m,highest_speed_m_s\n1,0.0,0.5,1.2,7.0\n1,0.5,1.0,0.0,0.25\n";
        assert_eq!(String::from_utf8(csv).unwrap(), expected);
    }

    #[test]
    fn csv_has_the_columns_that_are_no_lists() {
        let mut csv = Vec::new();
        write_csv(&recorded(), &mut csv).unwrap();
        let text = String::from_utf8(csv).unwrap();
        let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        assert_eq!((header.len(), header.contains(&"deposit_depth_mm")), (27, false));
        assert!(text.lines().all(|line| line.split(',').count() == 27), "{text}");
    }
}
