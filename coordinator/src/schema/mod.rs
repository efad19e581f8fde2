//! The campaign file described: every section and key with its type, unit, range and meaning, in the file's order.
//!
//! One description (`keys`) serves the JSON schema for editors (`json`) and the reference page (`page`). Tests hold
//! it against what the parser knows and what the checks refuse, so that it cannot say what is not so.

mod json;
mod keys;
mod page;

pub use json::json;
pub use keys::SECTIONS;
pub use page::page;

/// A section of the campaign file.
#[derive(Debug, Clone, Copy)]
pub struct Section {
    /// Its name in the schema; the top level has none.
    pub name: &'static str,
    /// How it begins in the file.
    pub header: &'static str,
    /// What it is about.
    pub meaning: &'static str,
    /// Its keys.
    pub keys: &'static [Key],
}

/// A key.
#[derive(Debug, Clone, Copy)]
pub struct Key {
    /// Name.
    pub name: &'static str,
    /// What values it takes.
    pub kind: Kind,
    /// What it means that it is absent; nothing where it is needed.
    pub absent: Option<&'static str>,
    /// What it says.
    pub meaning: &'static str,
}

/// What values a key takes.
#[derive(Debug, Clone, Copy)]
pub enum Kind {
    /// Any text.
    Text,
    /// One of these words.
    Words(&'static [&'static str]),
    /// A number in a range.
    Number(Range),
    /// A whole number between these, both included.
    Whole(u64, u64),
    /// `true` or `false`.
    Flag,
    /// `[smallest, largest]`.
    Pair,
    /// `[[x, y], ...]`.
    Line,
    /// A square matrix, a list a row.
    Matrix,
    /// An inline table with this one number.
    With(&'static str, Range),
    /// One of several.
    Either(&'static [Kind]),
    /// A section of this name.
    Table(&'static str),
    /// Any number of sections of this name.
    Tables(&'static str),
    /// A table whose keys are properties and whose values are such.
    ByProperty(&'static Kind),
}

/// A range of numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Lower end, and whether it is allowed itself.
    pub low: Option<(f64, bool)>,
    /// Upper end, and whether it is allowed itself.
    pub high: Option<(f64, bool)>,
}

/// Any finite number.
pub(crate) const ANY: Range = Range { low: None, high: None };
/// Greater than 0.
pub(crate) const POSITIVE: Range = Range { low: Some((0.0, false)), high: None };
/// 0 or greater.
pub(crate) const NON_NEGATIVE: Range = Range { low: Some((0.0, true)), high: None };
/// From 0, less than 1.
pub(crate) const SHARE: Range = Range { low: Some((0.0, true)), high: Some((1.0, false)) };

/// From `low` to `high`, both included.
pub(crate) const fn between(low: f64, high: f64) -> Range {
    Range { low: Some((low, true)), high: Some((high, true)) }
}

impl Range {
    /// The range in words; nothing if every number is in it.
    pub fn words(&self) -> String {
        match (self.low, self.high) {
            (None, None) => String::new(),
            (Some((low, true)), None) => format!("{low} or greater"),
            (Some((low, false)), None) => format!("greater than {low}"),
            (None, Some((high, true))) => format!("at most {high}"),
            (None, Some((high, false))) => format!("less than {high}"),
            (Some((low, true)), Some((high, true))) => format!("{low} to {high}"),
            (Some((low, from)), Some((high, to))) => {
                let from = if from { "from" } else { "greater than" };
                let to = if to { "at most" } else { "less than" };
                format!("{from} {low}, {to} {high}")
            }
        }
    }
}

impl Key {
    /// The unit, which stands at the end of the name; `1` for a number without one, nothing for what is no number.
    pub fn unit(&self) -> &'static str {
        const UNITS: [(&str, &str); 15] = [
            ("_kn_m3", "kN/m\u{b3}"),
            ("_kg_m3", "kg/m\u{b3}"),
            ("_m_s2", "m/s\u{b2}"),
            ("_per_s", "1/s"),
            ("_m_s", "m/s"),
            ("_kpa", "kPa"),
            ("_mpa", "MPa"),
            ("_deg", "\u{b0}"),
            ("_m", "m"),
            ("_s", "s"),
            ("bottom", "m"),
            ("water_table", "m"),
            ("tolerance", "m, m\u{b2} or 1"),
            ("base", "1"),
            ("contact", "1"),
        ];
        if !self.kind.is_number() {
            return "";
        }
        UNITS.iter().find(|(end, _)| self.name.ends_with(end)).map_or("1", |(_, unit)| unit)
    }
}

impl Kind {
    fn is_number(&self) -> bool {
        match self {
            Kind::Number(_) | Kind::Pair | Kind::Line | Kind::With(..) => true,
            Kind::Either(kinds) => kinds.iter().any(Kind::is_number),
            _ => false,
        }
    }
}

/// The section of this name.
///
/// # Panics
/// There is none: the table is wrong.
pub fn section(name: &str) -> &'static Section {
    SECTIONS.iter().find(|s| s.name == name).expect("every section that is named is described")
}
