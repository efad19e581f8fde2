//! ParaView files: one `.vtu` a moment (points as vertices, raw little-endian data appended) and the `.pvd` that lists
//! them in time; the background grid, which does not move, is a file of its own.
//!
//! After the VTK file formats' XML description (VTK User's Guide, "XML File Formats"): an unstructured grid whose
//! cells are single vertices (the grid's: squares), `encoding="raw"`, each array headed by its length in bytes as 64-bit integer.

use runout_core::gimp::Grid;
use std::fmt::Write as _;

/// VTK's number of the cell type "vertex".
const VTK_VERTEX: u8 = 1;
/// VTK's number of the cell type "quad": corners anticlockwise.
const VTK_QUAD: u8 = 9;

/// A quantity on the points.
#[derive(Debug, Clone, PartialEq)]
pub struct PointArray<'a> {
    /// Name with unit.
    pub name: &'a str,
    /// Numbers per point: 1, 3 (a vector) or 6 (a symmetric tensor: xx, yy, zz, xy, yz, xz).
    pub components: usize,
    /// `components` numbers a point.
    pub values: Vec<f64>,
}

/// Cells of one type between points.
struct Cells {
    /// VTK's number of the type.
    kind: u8,
    /// Points of a cell.
    corners: usize,
    /// The points of every cell, one cell after the other.
    points: Vec<i64>,
}

/// The bytes of a `.vtu` file: points at (x, y, 0) m with their arrays.
pub fn vtu(x: &[f64], y: &[f64], arrays: &[PointArray<'_>]) -> Vec<u8> {
    let cells = Cells { kind: VTK_VERTEX, corners: 1, points: (0..x.len() as i64).collect() };
    file(x, y, &cells, arrays)
}

/// The bytes of a `.vtu` file: the background grid's cells between its walls as squares.
pub fn grid(grid: &Grid) -> Vec<u8> {
    // The first node of a row and its last one lie behind the walls.
    let [columns, rows] = grid.nodes.map(|nodes| nodes - 2);
    let along = |axis: usize, node: usize| grid.origin_m[axis] + (node + 1) as f64 * grid.cell_m;
    let nodes = || (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j)));
    let x: Vec<f64> = nodes().map(|(i, _)| along(0, i)).collect();
    let y: Vec<f64> = nodes().map(|(_, j)| along(1, j)).collect();
    let corners = |(i, j): (usize, usize)| {
        let lower_left = j * columns + i;
        [lower_left, lower_left + 1, lower_left + columns + 1, lower_left + columns].map(|node| node as i64)
    };
    let points = nodes().filter(|&(i, j)| i + 1 < columns && j + 1 < rows).flat_map(corners).collect();
    file(&x, &y, &Cells { kind: VTK_QUAD, corners: 4, points }, &[])
}

fn file(x: &[f64], y: &[f64], cells: &Cells, arrays: &[PointArray<'_>]) -> Vec<u8> {
    let (points, count) = (x.len(), cells.points.len() / cells.corners);
    let mut appended = Appended::default();
    let mut head = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\">\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{count}\">\n"
    );
    head.push_str("<PointData>\n");
    for array in arrays {
        let bytes = array.values.iter().flat_map(|v| v.to_le_bytes()).collect();
        appended.array(&mut head, "Float64", array.name, array.components, bytes);
    }
    head.push_str("</PointData>\n<Points>\n");
    let positions = x.iter().zip(y).flat_map(|(x, y)| [*x, *y, 0.0]).flat_map(f64::to_le_bytes).collect();
    appended.array(&mut head, "Float64", "position", 3, positions);
    head.push_str("</Points>\n<Cells>\n");
    let connectivity = cells.points.iter().flat_map(|point| point.to_le_bytes()).collect();
    appended.array(&mut head, "Int64", "connectivity", 1, connectivity);
    let ends = (1..=count).flat_map(|cell| ((cell * cells.corners) as i64).to_le_bytes()).collect();
    appended.array(&mut head, "Int64", "offsets", 1, ends);
    appended.array(&mut head, "UInt8", "types", 1, vec![cells.kind; count]);
    head.push_str("</Cells>\n</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_");
    let mut file = head.into_bytes();
    file.extend(appended.bytes);
    file.extend(b"\n</AppendedData>\n</VTKFile>\n");
    file
}

/// The text of a `.pvd` file: (time in s, file name) of each moment.
pub fn pvd(moments: &[(f64, String)]) -> String {
    let mut text = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n<Collection>\n",
    );
    for (time_s, file) in moments {
        let _ = writeln!(text, "<DataSet timestep=\"{time_s}\" part=\"0\" file=\"{file}\"/>");
    }
    text + "</Collection>\n</VTKFile>\n"
}

#[derive(Default)]
struct Appended {
    bytes: Vec<u8>,
}

impl Appended {
    /// Announces an array in `head` and appends its bytes.
    fn array(&mut self, head: &mut String, kind: &str, name: &str, components: usize, bytes: Vec<u8>) {
        let offset = self.bytes.len();
        // One is what a reader takes where the number is left out; some readers make a matrix of a stated one.
        let components = match components {
            1 => String::new(),
            n => format!(" NumberOfComponents=\"{n}\""),
        };
        let _ = writeln!(
            head,
            "<DataArray type=\"{kind}\" Name=\"{name}\"{components} format=\"appended\" offset=\"{offset}\"/>"
        );
        self.bytes.extend((bytes.len() as u64).to_le_bytes());
        self.bytes.extend(bytes);
    }
}
