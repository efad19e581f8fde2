//! ParaView files: one `.vtu` a moment (points as vertices, raw little-endian data appended) and the `.pvd` that lists
//! them in time.
//!
//! After the VTK file formats' XML description (VTK User's Guide, "XML File Formats"): an unstructured grid whose
//! cells are single vertices, `encoding="raw"`, each array headed by its length in bytes as 64-bit integer.

use std::fmt::Write as _;

/// VTK's number of the cell type "vertex".
const VTK_VERTEX: u8 = 1;

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

/// The bytes of a `.vtu` file: points at (x, y, 0) m with their arrays.
pub fn vtu(x: &[f64], y: &[f64], arrays: &[PointArray<'_>]) -> Vec<u8> {
    let points = x.len();
    let mut appended = Appended::default();
    let mut head = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\">\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{points}\">\n"
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
    let connectivity = (0..points as i64).flat_map(i64::to_le_bytes).collect();
    appended.array(&mut head, "Int64", "connectivity", 1, connectivity);
    let offsets = (1..=points as i64).flat_map(i64::to_le_bytes).collect();
    appended.array(&mut head, "Int64", "offsets", 1, offsets);
    appended.array(&mut head, "UInt8", "types", 1, vec![VTK_VERTEX; points]);
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
