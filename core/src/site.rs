//! The site's measured properties: a table of laboratory tests, one row a test, one column a property.
//!
//! Text in, numbers out; nothing here opens a file. Rows with an empty or non-numeric cell are errors that name
//! the line and the column: a test is never dropped in silence.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A soil property that may be a random field. The order here is the order of the columns everywhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Property {
    /// Effective cohesion, kPa at the edge, Pa inside.
    #[serde(rename = "cohesion_kpa")]
    Cohesion,
    /// Effective friction angle, degrees at the edge, radians inside.
    #[serde(rename = "friction_angle_deg")]
    FrictionAngle,
    /// Saturated (total) unit weight, kN/m3.
    #[serde(rename = "unit_weight_kn_m3")]
    UnitWeight,
}

impl Property {
    /// All properties in column order.
    pub const ALL: [Property; 3] = [Property::Cohesion, Property::FrictionAngle, Property::UnitWeight];

    /// The property's name in campaign files, tables and JSON, with its unit.
    pub fn name(self) -> &'static str {
        match self {
            Property::Cohesion => "cohesion_kpa",
            Property::FrictionAngle => "friction_angle_deg",
            Property::UnitWeight => "unit_weight_kn_m3",
        }
    }

    /// The property of that name.
    pub fn from_name(name: &str) -> Option<Property> {
        Property::ALL.into_iter().find(|p| p.name() == name)
    }
}

/// Measured properties in edge units: `values[j][i]` is property `properties[j]` of test `i`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SiteData {
    /// Which properties were measured, in the order of [`Property::ALL`].
    pub properties: Vec<Property>,
    /// One vector of equal length per property, in edge units (kPa, degrees, kN/m3).
    pub values: Vec<Vec<f64>>,
}

impl SiteData {
    /// Number of tests (rows).
    pub fn tests(&self) -> usize {
        self.values.first().map_or(0, Vec::len)
    }
}

/// What to do with a measured value of exactly zero, which lognormal and Weibull families cannot hold.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ZeroRule {
    /// Keep zeros; families that cannot hold them are reported as not applicable.
    Keep,
    /// Drop every test that has a zero in any property.
    Drop,
    /// Replace zeros by this value, in the property's edge unit.
    Floor(f64),
}

/// A fault in the site table. Lines and columns count from 1; the caller adds the file's name.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SiteError {
    /// The header lacks a column that the campaign file names.
    #[error("column `{column}` is missing; the header has {header}")]
    MissingColumn {
        /// Name looked for.
        column: String,
        /// The header's names, joined.
        header: String,
    },
    /// There is nothing in it.
    #[error("it is empty; a header line and one line a test are needed")]
    Empty,
    /// The columns are not separated by commas.
    #[error(
        "the header `{header}` has {mark} between its names; columns must be separated by commas, and the decimal mark \
         must be a point"
    )]
    Separator {
        /// The header line.
        header: String,
        /// What separates the columns there.
        mark: &'static str,
    },
    /// A row has cells beyond the header's last column, as decimal commas make them.
    #[error(
        "line {line}: {found} cells under a header of {expected}; is there a decimal comma? The decimal mark must be a point"
    )]
    LongRow {
        /// Line in the file, the header being line 1.
        line: usize,
        /// Cells in the row.
        found: usize,
        /// Names in the header.
        expected: usize,
    },
    /// A cell is not a finite number at or above zero.
    #[error("line {line}, column `{column}`: `{value}` is not a number in [0, inf){hint}")]
    BadCell {
        /// Line in the file, the header being line 1.
        line: usize,
        /// Column name.
        column: String,
        /// The text found.
        value: String,
        /// What to do about it, or nothing.
        hint: &'static str,
    },
    /// Not a table: broken quoting, for example.
    #[error("{0}")]
    Table(String),
    /// Too few tests to fit two-parameter families and a copula.
    #[error("{found} tests after the rule for zeros; at least {needed} are needed")]
    TooFewTests {
        /// Tests left.
        found: usize,
        /// Tests needed.
        needed: usize,
    },
}

/// Fewest tests from which a fit is attempted: below this the rank correlation's sign itself is a guess
/// (a confession, not a theorem; with 5 tests Kendall's tau has a standard error of about 0.4).
pub const FEWEST_TESTS: usize = 5;

/// Reads the columns named in `columns` from CSV text with a header line, and applies `zeros`.
///
/// # Errors
/// An empty text, a missing column, columns that are not separated by commas, a row longer than the header, a cell that is not a
/// finite number >= 0, or fewer than [`FEWEST_TESTS`] tests.
pub fn parse(text: &str, columns: &[(Property, String)], zeros: ZeroRule) -> Result<SiteData, SiteError> {
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .flexible(true)
        .from_reader(text.trim_start_matches('\u{feff}').as_bytes());
    let header = reader.headers().cloned().unwrap_or_default();
    if header.is_empty() {
        return Err(SiteError::Empty);
    }
    let mut columns = columns.to_vec();
    columns.sort_by_key(|(p, _)| *p);
    let mut places = Vec::with_capacity(columns.len());
    for (_, name) in &columns {
        let place = header.iter().position(|h| h == name).ok_or_else(|| missing_column(name, &header))?;
        places.push(place);
    }

    let mut values = vec![Vec::new(); columns.len()];
    for record in reader.records() {
        let cells = record.map_err(|e| SiteError::Table(e.to_string()))?;
        let line = cells.position().map_or(0, |p| p.line() as usize);
        // Read by place, such a row would give wrong numbers in silence.
        if cells.iter().skip(header.len()).any(|cell| !cell.is_empty()) {
            return Err(SiteError::LongRow { line, found: cells.len(), expected: header.len() });
        }
        let mut row = Vec::with_capacity(columns.len());
        for (&place, (_, name)) in places.iter().zip(&columns) {
            row.push(read_cell(line, name, cells.get(place).unwrap_or(""))?);
        }
        if let ZeroRule::Floor(floor) = zeros {
            row.iter_mut().filter(|v| **v == 0.0).for_each(|v| *v = floor);
        }
        if zeros == ZeroRule::Drop && row.contains(&0.0) {
            continue;
        }
        for (column, value) in values.iter_mut().zip(row) {
            column.push(value);
        }
    }

    let found = values.first().map_or(0, Vec::len);
    if found < FEWEST_TESTS {
        return Err(SiteError::TooFewTests { found, needed: FEWEST_TESTS });
    }
    Ok(SiteData { properties: columns.into_iter().map(|(p, _)| p).collect(), values })
}

fn missing_column(name: &str, header: &csv::StringRecord) -> SiteError {
    let joined = header.iter().collect::<Vec<_>>().join(", ");
    let other = [(';', "semicolons"), ('\t', "tabs")].into_iter().find(|(mark, _)| joined.contains(*mark));
    match other {
        Some((_, mark)) => SiteError::Separator { header: joined.replace('\t', " "), mark },
        None => SiteError::MissingColumn { column: name.to_owned(), header: joined },
    }
}

fn read_cell(line: usize, column: &str, text: &str) -> Result<f64, SiteError> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value >= 0.0 => Ok(value),
        _ => {
            let comma = text.replacen(',', ".", 1).parse::<f64>().is_ok();
            let hint = if comma { "; the decimal mark must be a point" } else { "" };
            Err(SiteError::BadCell { line, column: column.to_owned(), value: text.to_owned(), hint })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns() -> Vec<(Property, String)> {
        vec![(Property::FrictionAngle, "phi".into()), (Property::Cohesion, "c".into())]
    }

    const TABLE: &str = "c,phi\n1,20\n0,21\n3,22\n4,23\n5,24\n6,25\n";

    #[test]
    fn columns_come_in_the_order_of_the_properties() {
        let data = parse(TABLE, &columns(), ZeroRule::Keep).unwrap();
        assert_eq!(data.properties, [Property::Cohesion, Property::FrictionAngle]);
        assert_eq!(data.values[0], [1.0, 0.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(data.tests(), 6);
    }

    #[test]
    fn the_rule_for_zeros_is_obeyed() {
        assert_eq!(parse(TABLE, &columns(), ZeroRule::Drop).unwrap().tests(), 5);
        assert_eq!(parse(TABLE, &columns(), ZeroRule::Floor(0.5)).unwrap().values[0][1], 0.5);
    }

    #[test]
    fn faults_name_line_and_column() {
        let bad = TABLE.replace("3,22", "3,22x");
        let error = parse(&bad, &columns(), ZeroRule::Keep).unwrap_err();
        assert_eq!(error.to_string(), "line 4, column `phi`: `22x` is not a number in [0, inf)");
        let error = parse("a,b\n1,2\n", &columns(), ZeroRule::Keep).unwrap_err();
        assert_eq!(error.to_string(), "column `c` is missing; the header has a, b");
    }

    #[test]
    fn tables_of_other_habits_are_refused_with_advice() {
        let said = |text: &str| parse(text, &columns(), ZeroRule::Keep).unwrap_err().to_string();
        assert!(said("c;phi\n1,5;20\n").starts_with("the header `c;phi` has semicolons between its names"));
        assert!(said("").starts_with("it is empty"));
        assert!(said("c\tphi\n1\t20\n").contains("has tabs between"));
        assert_eq!(
            said("c,phi\n1,20\n2,5,21\n"),
            "line 3: 3 cells under a header of 2; is there a decimal comma? The decimal mark must be a point"
        );
        assert!(said("c,phi\n\"2,5\",21\n").ends_with("[0, inf); the decimal mark must be a point"));
    }

    #[test]
    fn line_ends_of_other_systems_and_empty_last_cells_change_nothing() {
        let data = parse(TABLE, &columns(), ZeroRule::Keep).unwrap();
        assert_eq!(parse(&TABLE.replace('\n', "\r\n"), &columns(), ZeroRule::Keep).unwrap(), data);
        assert_eq!(parse(&TABLE.replace('\n', ",\n"), &columns(), ZeroRule::Keep).unwrap(), data);
    }
}
