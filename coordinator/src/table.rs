//! Aligned text tables for people: names to the left, numbers aligned at their decimal point.

/// Significant digits shown in tables: one more than the most digits of a reference value they are compared with.
const SIGNIFICANT_DIGITS: i32 = 10;

/// A table of text cells under a header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// An empty table with these column names.
    pub fn new<S: Into<String>>(header: impl IntoIterator<Item = S>) -> Table {
        Table { header: header.into_iter().map(Into::into).collect(), rows: Vec::new() }
    }

    /// Adds a row; missing cells are empty.
    pub fn row<S: Into<String>>(&mut self, cells: impl IntoIterator<Item = S>) {
        let mut row: Vec<String> = cells.into_iter().map(Into::into).collect();
        row.resize(self.header.len().max(row.len()), String::new());
        self.rows.push(row);
    }

    /// Column names.
    pub fn header(&self) -> &[String] {
        &self.header
    }

    /// Rows of cells; a row may have a note beyond the last column.
    pub fn rows(&self) -> &[Vec<String>] {
        &self.rows
    }

    /// The table as text: two spaces between columns, every line ended.
    pub fn render(&self) -> String {
        let columns: Vec<Vec<String>> = (0..self.header.len()).map(|j| self.column(j)).collect();
        let mut text = String::new();
        for i in 0..=self.rows.len() {
            let cells: Vec<&str> = columns.iter().map(|c| c[i].as_str()).collect();
            // A note may stand right of the last column.
            let note = if i > 0 { self.rows[i - 1][self.header.len()..].concat() } else { String::new() };
            text.push_str(format!("{}  {note}", cells.join("  ")).trim_end());
            text.push('\n');
        }
        text
    }

    /// Header and cells of column `j`, padded to one width.
    fn column(&self, j: usize) -> Vec<String> {
        let cells: Vec<&str> = self.rows.iter().map(|r| r[j].as_str()).collect();
        let whole = |cell: &str| cell.find('.').unwrap_or(cell.chars().count());
        let numbers = cells.iter().filter(|c| is_number(c));
        let most_whole = numbers.clone().map(|c| whole(c)).max().unwrap_or(0);
        let most_part = numbers.map(|c| c.chars().count() - whole(c)).max().unwrap_or(0);
        let width = |cell: &str| if is_number(cell) { most_whole + most_part } else { cell.chars().count() };
        let widest =
            cells.iter().map(|c| width(c)).chain([self.header[j].chars().count()]).max().unwrap_or(0);
        let numeric = most_whole > 0;
        let pad = |cell: &str| {
            if is_number(cell) {
                let right = most_part - (cell.chars().count() - whole(cell));
                format!("{:>widest$}", format!("{cell}{}", " ".repeat(right)))
            } else if numeric {
                format!("{cell:>widest$}")
            } else {
                format!("{cell:<widest$}")
            }
        };
        std::iter::once(self.header[j].as_str()).chain(cells).map(pad).collect()
    }
}

/// Names and values as two columns, both to the left.
pub fn list<S: AsRef<str>>(pairs: &[(S, String)]) -> String {
    let width = pairs.iter().map(|(name, _)| name.as_ref().chars().count()).max().unwrap_or(0);
    pairs.iter().map(|(name, value)| format!("{:<width$}  {value}\n", name.as_ref())).collect()
}

fn is_number(cell: &str) -> bool {
    cell.starts_with(|c: char| c.is_ascii_digit() || c == '-') && cell.parse::<f64>().is_ok()
}

/// `value` with ten significant digits, trailing zeros left out.
pub fn number(value: f64) -> String {
    significant(value, SIGNIFICANT_DIGITS)
}

/// `value` with that many significant digits, trailing zeros left out; in exponent form if it is very small or large.
pub fn significant(value: f64, digits: i32) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return value.to_string();
    }
    let exponent = value.abs().log10().floor() as i32;
    if !(-5..12).contains(&exponent) {
        return format!("{value:.*e}", (digits - 1).max(0) as usize);
    }
    let text = format!("{value:.*}", (digits - 1 - exponent).max(0) as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// As [`number`], with a dash for an absent value.
pub fn optional(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_ten_digits_and_align_at_the_point() {
        assert_eq!(number(0.0173953072345), "0.01739530723");
        assert_eq!(number(11.412), "11.412");
        assert_eq!(number(1e-9), "1.000000000e-9");
        let mut table = Table::new(["family", "AIC"]);
        table.row(["frank", "-11.5"]);
        table.row(["no16", "8.25"]);
        table.row(["x", "-"]);
        assert_eq!(table.render(), "family     AIC\nfrank   -11.5\nno16      8.25\nx            -\n");
    }

    #[test]
    fn an_empty_table_is_its_header() {
        assert_eq!(Table::new(["a", "b"]).render(), "a  b\n");
    }
}
