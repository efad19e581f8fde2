//! The table as Parquet: typed columns, missing values as nulls, the schema's description in the file's metadata
//! (`runout.schema`) beside the spec's digest and the campaign's name.

use super::{COLUMNS, Column, Kind, Value};
use crate::store::log::Record;
use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::Result;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::Type;
use std::io::Write;
use std::sync::Arc;

/// Rows of a row group: what readers take in one go.
const GROUP_ROWS: usize = 100_000;

/// Where a table is from.
#[derive(Debug, Clone, Copy)]
pub struct Origin<'a> {
    /// Name of the campaign.
    pub campaign: &'a str,
    /// Digest of the spec.
    pub digest: &'a str,
}

/// Writes the table of `records`, in their order.
///
/// # Errors
/// `out` fails.
pub fn write(records: &[Record], origin: Origin<'_>, out: impl Write + Send) -> Result<()> {
    let fields = COLUMNS.iter().map(field).collect::<Result<Vec<_>>>()?;
    let schema = Arc::new(Type::group_type_builder("outcomes").with_fields(fields).build()?);
    let metadata = vec![
        KeyValue::new("runout.campaign".to_owned(), origin.campaign.to_owned()),
        KeyValue::new("runout.spec_digest".to_owned(), origin.digest.to_owned()),
        KeyValue::new("runout.schema".to_owned(), schema_json()),
    ];
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_created_by(format!("runout {}", runout_proto::identity::build()))
        .set_key_value_metadata(Some(metadata))
        .build();
    let mut file = SerializedFileWriter::new(out, schema, Arc::new(properties))?;
    for rows in records.chunks(GROUP_ROWS) {
        let mut group = file.next_row_group()?;
        for column in &COLUMNS {
            let mut writer = group.next_column()?.expect("the schema has as many columns");
            write_column(column, rows, &mut writer)?;
            writer.close()?;
        }
        group.close()?;
    }
    file.close()?;
    Ok(())
}

/// The table's description in one line.
fn schema_json() -> String {
    serde_json::to_string(&super::schema()).expect("a schema holds only words")
}

fn field(column: &Column) -> Result<Arc<Type>> {
    let repetition = if column.missing.is_some() { Repetition::OPTIONAL } else { Repetition::REQUIRED };
    let (physical, logical) = match column.kind {
        Kind::Integers => return list(column.name, repetition),
        Kind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        Kind::Integer => (Physical::INT64, None),
        Kind::Number => (Physical::DOUBLE, None),
    };
    let builder = Type::primitive_type_builder(column.name, physical);
    Ok(Arc::new(builder.with_logical_type(logical).with_repetition(repetition).build()?))
}

/// A list of whole numbers in the form that readers know: a group that may be missing, of a group that is repeated, of
/// an element.
fn list(name: &str, repetition: Repetition) -> Result<Arc<Type>> {
    let required =
        Type::primitive_type_builder("element", Physical::INT64).with_repetition(Repetition::REQUIRED);
    let repeated = Type::group_type_builder("list")
        .with_repetition(Repetition::REPEATED)
        .with_fields(vec![Arc::new(required.build()?)]);
    let group = Type::group_type_builder(name)
        .with_repetition(repetition)
        .with_logical_type(Some(LogicalType::List))
        .with_fields(vec![Arc::new(repeated.build()?)]);
    Ok(Arc::new(group.build()?))
}

/// Writes the values that are there, and for a column that may miss some which ones are.
fn write_column(column: &Column, rows: &[Record], writer: &mut SerializedColumnWriter<'_>) -> Result<()> {
    let cells = || rows.iter().map(|record| column.value(record));
    let present: Vec<i16> = cells().map(|cell| i16::from(is_present(cell))).collect();
    let levels = column.missing.is_some().then_some(present.as_slice());
    match column.kind {
        Kind::Text => {
            let values: Vec<ByteArray> = cells().filter_map(as_text).map(ByteArray::from).collect();
            writer.typed::<ByteArrayType>().write_batch(&values, levels, None)?;
        }
        Kind::Integer => {
            let values: Vec<i64> = cells().filter_map(as_integer).collect();
            writer.typed::<Int64Type>().write_batch(&values, levels, None)?;
        }
        Kind::Number => {
            let values: Vec<f64> = cells().filter_map(as_number).collect();
            writer.typed::<DoubleType>().write_batch(&values, levels, None)?;
        }
        Kind::Integers => {
            let Lists { values, definition, repetition } = cells().map(as_integers).collect();
            writer.typed::<Int64Type>().write_batch(&values, Some(&definition), Some(&repetition))?;
        }
    }
    Ok(())
}

/// Lists as Parquet takes them apart: all their values, and for each value, empty and missing list a pair of levels.
#[derive(Default)]
struct Lists {
    values: Vec<i64>,
    /// 0: the list is missing; 1: it is empty; 2: here is a value.
    definition: Vec<i16>,
    /// 0 where a list begins, 1 where it goes on.
    repetition: Vec<i16>,
}

impl<'a> FromIterator<Option<&'a [u32]>> for Lists {
    fn from_iter<I: IntoIterator<Item = Option<&'a [u32]>>>(all: I) -> Lists {
        let mut lists = Lists::default();
        for list in all {
            let values = list.unwrap_or_default();
            lists.values.extend(values.iter().copied().map(i64::from));
            if values.is_empty() {
                lists.definition.push(i16::from(list.is_some()));
                lists.repetition.push(0);
            }
            for place in 0..values.len() {
                lists.definition.push(2);
                lists.repetition.push(i16::from(place > 0));
            }
        }
        lists
    }
}

fn is_present(cell: Value<'_>) -> bool {
    match cell {
        Value::Text(value) => value.is_some(),
        Value::Integer(value) => value.is_some(),
        Value::Number(value) => value.is_some(),
        Value::Integers(value) => value.is_some(),
    }
}

fn as_text(cell: Value<'_>) -> Option<&str> {
    if let Value::Text(value) = cell { value } else { None }
}

/// Every whole number of the table is far below 2^63; one above is shown as the largest.
fn as_integer(cell: Value<'_>) -> Option<i64> {
    if let Value::Integer(value) = cell { value.map(|v| i64::try_from(v).unwrap_or(i64::MAX)) } else { None }
}

fn as_number(cell: Value<'_>) -> Option<f64> {
    if let Value::Number(value) = cell { value } else { None }
}

fn as_integers(cell: Value<'_>) -> Option<&[u32]> {
    if let Value::Integers(value) = cell { value } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::tests::record;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::Field;
    use runout_core::outcome::{OutcomeKind, Reason};
    use runout_core::profile::Profile;

    /// Every cell is read back as it was, nulls included, over several row groups.
    #[test]
    fn a_table_is_read_back_cell_by_cell() {
        let rows = GROUP_ROWS as u64 + 7;
        let records: Vec<Record> = (0..rows).map(varied).collect();
        let mut bytes = Vec::new();
        write(&records, Origin { campaign: "Elkhorn \u{2713}", digest: "d" }, &mut bytes).unwrap();
        let reader = SerializedFileReader::new(bytes::Bytes::from(bytes)).unwrap();
        assert_eq!(reader.num_row_groups(), 2);
        let metadata = reader.metadata().file_metadata();
        let value = |key: &str| {
            let pairs = metadata.key_value_metadata().unwrap();
            pairs.iter().find(|pair| pair.key == key).unwrap().value.clone().unwrap()
        };
        assert_eq!(
            (value("runout.campaign"), value("runout.spec_digest")),
            ("Elkhorn \u{2713}".into(), "d".into())
        );
        assert_eq!(value("runout.schema"), schema_json());
        let mut read = 0;
        for (row, record) in reader.get_row_iter(None).unwrap().zip(&records) {
            for ((name, field), column) in row.unwrap().get_column_iter().zip(&COLUMNS) {
                assert_eq!(name, column.name);
                let same = match (column.value(record), field) {
                    (Value::Text(Some(a)), Field::Str(b)) => a == b,
                    (Value::Integer(Some(a)), Field::Long(b)) => a == *b as u64,
                    (Value::Number(Some(a)), Field::Double(b)) => a.to_bits() == b.to_bits(),
                    (Value::Integers(Some(a)), Field::ListInternal(b)) => {
                        let expected = a.iter().map(|value| Field::Long(i64::from(*value)));
                        expected.collect::<Vec<_>>() == b.elements()
                    }
                    (cell, Field::Null) => !is_present(cell) && column.missing.is_some(),
                    _ => false,
                };
                assert!(same, "{name} of {}: {field:?}", record.outcome.index);
            }
            read += 1;
        }
        assert_eq!(read, records.len());
    }

    #[test]
    fn a_table_without_rows_has_its_columns() {
        let mut bytes = Vec::new();
        write(&[], Origin { campaign: "", digest: "" }, &mut bytes).unwrap();
        let reader = SerializedFileReader::new(bytes::Bytes::from(bytes)).unwrap();
        assert_eq!(reader.metadata().file_metadata().num_rows(), 0);
        let schema = reader.metadata().file_metadata().schema_descr().root_schema().clone();
        let names: Vec<&str> = schema.get_fields().iter().map(|field| field.name()).collect();
        assert_eq!(names, COLUMNS.map(|column| column.name));
    }

    /// Failed ones, ones that had not come to rest, marked ones; profiles with and without values, and none.
    fn varied(index: u64) -> Record {
        let mut record = record(index);
        record.outcome.profile = None;
        match index % 5 {
            0 => {
                record.outcome.outcome = OutcomeKind::Failed;
                record.outcome.reason = Reason::ALL[3 + index as usize % 5];
                (record.outcome.measures, record.outcome.energy) = (None, None);
            }
            1 => {
                record.outcome.reason = Reason::StillMoving;
                record.outcome.measures.as_mut().unwrap().time_to_rest_s = None;
            }
            2 => record.outcome.energy_drifted = true,
            _ => {}
        }
        if index % 5 > 1 {
            let values = |count: u64| (1..=count).map(|value| value as u32).collect();
            let (depth_mm, speed_mm_s) = (values(index % 7), values(index % 3));
            record.outcome.profile = Some(Profile { column_m: 0.5, depth_mm, speed_mm_s });
        }
        record
    }
}
