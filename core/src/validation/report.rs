//! What a case of the validation suite is and what it tells.

/// How much work a case may do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Depth {
    /// Coarse, for tests: seconds a case.
    Quick,
    /// All resolutions and durations: up to some minutes a case.
    Full,
}

/// A case of the validation suite.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    /// Name on the command line, for example `gravity-column`.
    pub name: &'static str,
    /// Title in the report.
    pub title: &'static str,
    /// What is analysed, where the reference comes from, where the tolerances come from; one paragraph.
    pub about: &'static str,
    /// Runs it.
    pub run: fn(Depth) -> Findings,
}

/// What a case found.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Findings {
    /// Comparisons with the reference.
    pub checks: Vec<Check>,
    /// Figures.
    pub figures: Vec<Figure>,
    /// Remarks for the report.
    pub notes: Vec<String>,
}

impl Findings {
    /// Whether every check that can fail has passed.
    pub fn passes(&self) -> bool {
        self.checks.iter().all(Check::passes)
    }
}

/// How a figure compares with its reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Comparison {
    /// found / reference - 1 is at most this in size.
    Relative(f64),
    /// found - reference is at most this in size.
    Absolute(f64),
    /// The reference is an upper bound.
    AtMost,
    /// The reference is a lower bound.
    AtLeast,
    /// Shown beside the reference; it cannot fail.
    Information,
}

/// One figure compared with its reference.
#[derive(Debug, Clone, PartialEq)]
pub struct Check {
    /// What was measured, with its resolution, for example `settlement of the top, 20 cells`.
    pub what: String,
    /// Unit of `reference` and `found`; empty if dimensionless.
    pub unit: &'static str,
    /// Reference value or bound.
    pub reference: f64,
    /// Value found.
    pub found: f64,
    /// How they compare.
    pub comparison: Comparison,
}

impl Check {
    /// found / reference - 1 is at most `tolerance` in size.
    pub fn relative(
        what: impl Into<String>,
        unit: &'static str,
        reference: f64,
        found: f64,
        tolerance: f64,
    ) -> Check {
        Check { what: what.into(), unit, reference, found, comparison: Comparison::Relative(tolerance) }
    }

    /// found - reference is at most `tolerance` in size, in the same unit.
    pub fn absolute(
        what: impl Into<String>,
        unit: &'static str,
        reference: f64,
        found: f64,
        tolerance: f64,
    ) -> Check {
        Check { what: what.into(), unit, reference, found, comparison: Comparison::Absolute(tolerance) }
    }

    /// found is at most `bound`.
    pub fn at_most(what: impl Into<String>, unit: &'static str, bound: f64, found: f64) -> Check {
        Check { what: what.into(), unit, reference: bound, found, comparison: Comparison::AtMost }
    }

    /// found is at least `bound`.
    pub fn at_least(what: impl Into<String>, unit: &'static str, bound: f64, found: f64) -> Check {
        Check { what: what.into(), unit, reference: bound, found, comparison: Comparison::AtLeast }
    }

    /// Shown beside `reference`; cannot fail.
    pub fn information(what: impl Into<String>, unit: &'static str, reference: f64, found: f64) -> Check {
        Check { what: what.into(), unit, reference, found, comparison: Comparison::Information }
    }

    /// Error in the sense of the comparison; absent for bounds and for information without a reference.
    pub fn error(&self) -> Option<f64> {
        match self.comparison {
            Comparison::Relative(_) => Some(self.found / self.reference - 1.0),
            Comparison::Absolute(_) => Some(self.found - self.reference),
            Comparison::AtMost | Comparison::AtLeast => None,
            Comparison::Information => {
                (self.reference != 0.0).then(|| self.found / self.reference - 1.0).filter(|e| e.is_finite())
            }
        }
    }

    /// Whether it passes; not a number never does.
    pub fn passes(&self) -> bool {
        match self.comparison {
            Comparison::Relative(tolerance) => (self.found / self.reference - 1.0).abs() <= tolerance,
            Comparison::Absolute(tolerance) => (self.found - self.reference).abs() <= tolerance,
            Comparison::AtMost => self.found <= self.reference,
            Comparison::AtLeast => self.found >= self.reference,
            Comparison::Information => true,
        }
    }
}

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Marks {
    /// A line: a reference, or something computed at many places.
    Line,
    /// Circles: what was found.
    Circles,
    /// Dots: material points.
    Dots,
}

/// A series of a figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Its name in the legend; empty: it is not named there.
    pub label: String,
    /// Its points, (x, y).
    pub points: Vec<[f64; 2]>,
    /// How it is drawn.
    pub marks: Marks,
}

impl Series {
    /// A reference, or something computed at many places.
    pub fn line(label: impl Into<String>, points: Vec<[f64; 2]>) -> Series {
        Series { label: label.into(), points, marks: Marks::Line }
    }

    /// What was found.
    pub fn circles(label: impl Into<String>, points: Vec<[f64; 2]>) -> Series {
        Series { label: label.into(), points, marks: Marks::Circles }
    }

    /// Material points.
    pub fn dots(label: impl Into<String>, points: Vec<[f64; 2]>) -> Series {
        Series { label: label.into(), points, marks: Marks::Dots }
    }
}

/// A figure of a case.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Name of its file without extension, unique within the case.
    pub name: String,
    /// Title.
    pub title: String,
    /// Label of the horizontal axis, with unit.
    pub x: String,
    /// Label of the vertical axis, with unit.
    pub y: String,
    /// Whether both axes have the same scale (pictures of bodies).
    pub equal_axes: bool,
    /// Its series.
    pub series: Vec<Series>,
}
