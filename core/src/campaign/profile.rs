//! A surveyed section of the ground surface: CSV text to a line.
//!
//! A header with the columns `x_m` and `y_m`, then a point a row from the uphill end to the downhill end; other columns
//! are left alone, lines that begin with `#` are comments. x may not fall; two points of the same x make a vertical
//! step (a cut, a wall of soil).

use super::{LineFault, MOST_POINTS, Polyline};
use thiserror::Error;

const COLUMNS: [&str; 2] = ["x_m", "y_m"];

/// A fault in a section. Lines count from 1; the caller adds the file's name.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ProfileError {
    /// The header lacks a column.
    #[error("column `{column}` is missing; the header has {header}")]
    MissingColumn {
        /// Name looked for.
        column: &'static str,
        /// The header's names, joined.
        header: String,
    },
    /// A cell is not a finite number.
    #[error("line {line}, column `{column}`: `{value}` is not a number")]
    BadCell {
        /// Line in the file.
        line: usize,
        /// Column name.
        column: &'static str,
        /// The text found.
        value: String,
    },
    /// A point lies left of the one before, or is the third of one x.
    #[error(
        "line {line}, column `x_m`: {x_m} is not allowed after {before_m}; x must grow from the uphill to the downhill \
         end, or stay the same once (a vertical step)"
    )]
    Order {
        /// Line in the file.
        line: usize,
        /// x of the point, m.
        x_m: f64,
        /// x of the point before, m.
        before_m: f64,
    },
    /// Too few or too many points.
    #[error("{found} points; a section has from 2 to {MOST_POINTS}")]
    Count {
        /// Points found.
        found: usize,
    },
    /// Not a table: broken quoting or rows of different lengths.
    #[error("{0}")]
    Table(String),
}

/// Reads a section.
///
/// # Errors
/// A missing column, a cell that is no number, points out of order, too few or too many of them.
pub fn parse(text: &str) -> Result<Polyline, ProfileError> {
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(text.trim_start_matches('\u{feff}').as_bytes());
    let table = |e: csv::Error| ProfileError::Table(e.to_string());
    let header = reader.headers().map_err(table)?.clone();
    let mut places = [0; 2];
    for (place, column) in places.iter_mut().zip(COLUMNS) {
        let names = || header.iter().collect::<Vec<_>>().join(", ");
        *place = header
            .iter()
            .position(|name| name == column)
            .ok_or_else(|| ProfileError::MissingColumn { column, header: names() })?;
    }
    let (mut points, mut lines) = (Vec::new(), Vec::new());
    for record in reader.records() {
        let cells = record.map_err(table)?;
        let line = cells.position().map_or(0, |p| p.line() as usize);
        let mut point = [0.0; 2];
        for axis in 0..2 {
            let cell = cells.get(places[axis]).unwrap_or("");
            point[axis] = cell.parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(|| {
                ProfileError::BadCell { line, column: COLUMNS[axis], value: cell.to_owned() }
            })?;
        }
        points.push(point);
        lines.push(line);
    }
    if !(2..=MOST_POINTS).contains(&points.len()) {
        return Err(ProfileError::Count { found: points.len() });
    }
    let order =
        |i: usize| ProfileError::Order { line: lines[i], x_m: points[i][0], before_m: points[i - 1][0] };
    Polyline::new(points.clone()).map_err(|fault| match fault {
        LineFault::Backwards(n) | LineFault::ThirdOfStep(n) => order(n - 1),
        LineFault::Empty | LineFault::TooMany | LineFault::NotFinite(_) => {
            ProfileError::Count { found: points.len() }
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_is_read_by_its_columns_names() {
        let line =
            parse("y_m,note,x_m\n# survey of May\n12.5,crest,0\n2.5,,10\n0.5,wall,10\n0,,30\n").unwrap();
        assert_eq!(line.points(), [[0.0, 12.5], [10.0, 2.5], [10.0, 0.5], [30.0, 0.0]]);
    }

    #[test]
    fn faults_name_line_and_column() {
        let said = |text: &str| parse(text).unwrap_err().to_string();
        assert_eq!(said("x,y_m\n0,1\n"), "column `x_m` is missing; the header has x, y_m");
        assert_eq!(said("x_m,y_m\n0,1\n1,two\n"), "line 3, column `y_m`: `two` is not a number");
        assert_eq!(said("x_m,y_m\n0,inf\n"), "line 2, column `y_m`: `inf` is not a number");
        assert!(said("x_m,y_m\n0,1\n-1,1\n").starts_with("line 3, column `x_m`: -1 is not allowed after 0"));
        assert!(
            said("x_m,y_m\n0,1\n0,2\n0,3\n").starts_with("line 4, column `x_m`: 0 is not allowed after 0")
        );
        assert_eq!(said("x_m,y_m\n0,1\n"), "1 points; a section has from 2 to 10000");
        assert!(said("x_m,y_m\n0,1\n0,1,2\n").contains("line"), "{}", said("x_m,y_m\n0,1\n0,1,2\n"));
    }
}
