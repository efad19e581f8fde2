//! The uGIMP functions as they are defined: the hat function of a node averaged over a point's length (Bardenhagen & Kober
//! 2004; Steffen, Kirby & Berzins 2008, Eq. 33), in two dimensions as products.

use runout_core::gimp::Grid;

/// A node that a point reaches.
#[derive(Debug, Clone, Copy)]
pub struct Near {
    /// Index of the node.
    pub node: usize,
    /// S.
    pub s: f64,
    /// Gradient of S, 1/m.
    pub gradient: [f64; 2],
}

/// S and its derivative (1/m) at distance `r` from the node, for cells of `h` and points of half the length `l`, all in m.
fn gimp(r: f64, h: f64, l: f64) -> (f64, f64) {
    let d = r.abs();
    let sign = r.signum();
    if d < l {
        (1.0 - (d * d + l * l) / (2.0 * h * l), -r / (h * l))
    } else if d <= h - l {
        (1.0 - d / h, -sign / h)
    } else if d < h + l {
        let left = h + l - d;
        (left * left / (4.0 * h * l), -sign * left / (2.0 * h * l))
    } else {
        (0.0, 0.0)
    }
}

/// The nodes that a point at `position` reaches, its half-lengths in cells: three along each axis.
pub fn near(grid: &Grid, half_lengths: [f64; 2], position: [f64; 2]) -> Vec<Near> {
    let h = grid.cell_m;
    let along = |a: usize| -> Vec<(usize, f64, f64)> {
        let nearest = ((position[a] - grid.origin_m[a]) / h).round() as usize;
        (nearest - 1..=nearest + 1)
            .map(|i| {
                let (s, slope) =
                    gimp(position[a] - (grid.origin_m[a] + i as f64 * h), h, half_lengths[a] * h);
                (i, s, slope)
            })
            .collect()
    };
    let (columns, rows) = (along(0), along(1));
    let mut near = Vec::with_capacity(9);
    for &(j, sy, dy) in &rows {
        for &(i, sx, dx) in &columns {
            near.push(Near { node: j * grid.nodes[0] + i, s: sx * sy, gradient: [dx * sy, sx * dy] });
        }
    }
    near
}
