//! The lattice on which the white noise lives: the bounding rectangle of the material points, in the bedding's frame.
//!
//! Sampling the whole rectangle and taking the cells that carry points has the law of a field on the points alone.
//! Without rotation every point is the centre of its own cell. With rotation the lattice lies along the bedding at half
//! the points' spacing and each point takes its nearest cell: no two points share a cell, since cells are closer than
//! points, and none is further than 0.36 spacings from the centre whose value it takes.

use super::FieldError;

/// Most cells of a lattice: 128 MiB of noise a property.
pub const MOST_CELLS: u64 = 1 << 24;

/// How far a point may be from the centre of its cell without rotation, as a share of the spacing: room for the
/// rounding of coordinates up to some kilometres, far below what a shifted point would show.
const OFF_CENTRE: f64 = 1e-6;

/// In a cell without a point.
const NO_POINT: u32 = u32::MAX;

/// With rotation, cells a point spacing.
const ROTATED_REFINEMENT: f64 = 2.0;

/// A point in its row. Narrow numbers, since memory's speed counts in large fields.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Column of its cell.
    pub column: u32,
    /// Number of the point.
    pub point: u32,
}

/// The lattice and where the points stand in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Lattice {
    /// Cells in a row, along the bedding.
    pub columns: usize,
    /// Rows, across the bedding.
    pub rows: usize,
    /// Side of a cell, m.
    pub spacing_m: f64,
    /// Where points stand, by rows, and from the first column in each. Shape: points.
    places: Vec<Place>,
    /// Number of points before each row, and in all. Shape: rows + 1.
    starts: Vec<usize>,
    /// Cells of each row, from its first, that a point in this row or a later one depends on: those left of and under
    /// points. Never grows from row to row. Shape: rows.
    pub reach: Vec<usize>,
}

impl Lattice {
    /// The lattice of points at `x`, `y` (m, shape: points) that stand `spacing_m` apart, for a bedding that dips by
    /// `rotation_rad` (counter-clockwise from the x axis).
    ///
    /// # Errors
    /// No points, coordinates that are not finite, more than [`MOST_CELLS`] cells, or, without rotation, points that do
    /// not stand on a square lattice of that spacing, each alone.
    pub fn new(x: &[f64], y: &[f64], spacing_m: f64, rotation_rad: f64) -> Result<Lattice, FieldError> {
        check(x, y, spacing_m)?;
        let (sin, cos) = libm::sincos(rotation_rad);
        let rotated = rotation_rad != 0.0;
        let spacing_m = if rotated { spacing_m / ROTATED_REFINEMENT } else { spacing_m };
        let turned = |(x, y): (&f64, &f64)| (cos * x + sin * y, cos * y - sin * x);
        let points: Vec<(f64, f64)> = x.iter().zip(y).map(turned).collect();

        let low = points.iter().fold((f64::INFINITY, f64::INFINITY), |a, p| (a.0.min(p.0), a.1.min(p.1)));
        let place = |p: &(f64, f64)| ((p.0 - low.0) / spacing_m, (p.1 - low.1) / spacing_m);
        let (width, height) =
            points.iter().map(place).fold((0.0_f64, 0.0_f64), |a, p| (a.0.max(p.0), a.1.max(p.1)));
        let (columns, rows) = (width.round() + 1.0, height.round() + 1.0);
        if columns * rows > MOST_CELLS as f64 {
            return Err(FieldError::TooLarge { cells: columns * rows, limit: MOST_CELLS });
        }

        let (columns, rows) = (columns as usize, rows as usize);
        let mut point_of = vec![NO_POINT; columns * rows];
        let mut reach = vec![0; rows];
        for (point, at) in points.iter().map(place).enumerate() {
            let (column, row) = (at.0.round(), at.1.round());
            let cell = row as usize * columns + column as usize;
            let off = (at.0 - column).abs().max((at.1 - row).abs());
            if point_of[cell] != NO_POINT || (!rotated && off > OFF_CENTRE) {
                return Err(FieldError::OffLattice { point, x_m: x[point], y_m: y[point], spacing_m });
            }
            point_of[cell] = point as u32;
            reach[row as usize] = reach[row as usize].max(column as usize + 1);
        }
        for row in (1..rows).rev() {
            reach[row - 1] = reach[row - 1].max(reach[row]);
        }
        let mut places = Vec::with_capacity(points.len());
        let mut starts = vec![0];
        for row in point_of.chunks_exact(columns) {
            let taken = row.iter().enumerate().filter(|(_, point)| **point != NO_POINT);
            places.extend(taken.map(|(column, point)| Place { column: column as u32, point: *point }));
            starts.push(places.len());
        }
        Ok(Lattice { columns, rows, spacing_m, places, starts, reach })
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.places.len()
    }

    /// The points of a row.
    pub fn row(&self, row: usize) -> &[Place] {
        &self.places[self.starts[row]..self.starts[row + 1]]
    }

    /// Cell of each point: row * columns + column.
    pub fn cells(&self) -> Vec<usize> {
        let mut cells = vec![0; self.places.len()];
        for row in 0..self.rows {
            for place in self.row(row) {
                cells[place.point as usize] = row * self.columns + place.column as usize;
            }
        }
        cells
    }

    /// Number of cells.
    pub fn size(&self) -> usize {
        self.columns * self.rows
    }
}

fn check(x: &[f64], y: &[f64], spacing_m: f64) -> Result<(), FieldError> {
    if x.is_empty() || x.len() != y.len() {
        return Err(FieldError::Points { x: x.len(), y: y.len() });
    }
    if !(spacing_m > 0.0 && spacing_m.is_finite()) {
        return Err(FieldError::Value { name: "spacing_m", value: spacing_m });
    }
    for (name, values) in [("x", x), ("y", y)] {
        if let Some(&value) = values.iter().find(|v| !v.is_finite()) {
            return Err(FieldError::Value { name, value });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle of points, far from the origin.
    fn triangle(side: usize) -> (Vec<f64>, Vec<f64>) {
        (0..side)
            .flat_map(|row| (0..side - row).map(move |c| (-33.9 + 0.2 * c as f64, 4.1 + 0.2 * row as f64)))
            .unzip()
    }

    #[test]
    fn points_stand_on_their_own_cells() {
        let (x, y) = triangle(7);
        let lattice = Lattice::new(&x, &y, 0.2, 0.0).unwrap();
        assert_eq!((lattice.columns, lattice.rows), (7, 7));
        for (point, cell) in lattice.cells().iter().enumerate() {
            let (column, row) = (cell % 7, cell / 7);
            assert!((x[point] - (-33.9 + 0.2 * column as f64)).abs() < 1e-9);
            assert!((y[point] - (4.1 + 0.2 * row as f64)).abs() < 1e-9);
        }
    }

    #[test]
    fn rotated_points_never_share_a_cell() {
        let (x, y) = triangle(40);
        for degrees in [-90.0, -37.0, 1.0, 30.0, 45.0, 89.9] {
            let lattice = Lattice::new(&x, &y, 0.2, f64::to_radians(degrees)).unwrap();
            assert_eq!(lattice.points(), x.len());
            assert_eq!(lattice.spacing_m, 0.1);
        }
    }

    #[test]
    fn what_is_no_lattice_is_refused() {
        let error = |x: &[f64], y: &[f64], spacing| Lattice::new(x, y, spacing, 0.0).unwrap_err();
        assert!(matches!(error(&[], &[], 0.2), FieldError::Points { .. }));
        assert!(matches!(error(&[0.0], &[0.0, 1.0], 0.2), FieldError::Points { .. }));
        assert!(matches!(error(&[0.0, f64::NAN], &[0.0; 2], 0.2), FieldError::Value { .. }));
        assert!(matches!(error(&[0.0], &[0.0], 0.0), FieldError::Value { .. }));
        assert!(matches!(error(&[0.0, 0.3], &[0.0; 2], 0.2), FieldError::OffLattice { point: 1, .. }));
        assert!(matches!(error(&[0.0, 0.0], &[0.0; 2], 0.2), FieldError::OffLattice { point: 1, .. }));
        assert!(matches!(error(&[0.0, 1e9], &[0.0; 2], 0.2), FieldError::TooLarge { .. }));
    }
}
