//! Measures of what moved.
//!
//! u is the displacement of a point since the start of the failure stage. A point is drawn as a square of its
//! initial spacing, so that fronts and heights include half a spacing.
//!
//! * Maximum displacement: the largest |u| (what the paper calls runout distance).
//! * 99.9 % quantile: of |u| over the points, linear between order statistics (Hyndman & Fan 1996, type 7).
//! * Toe advance: front of the contiguous material that started above the reference level, less the initial toe
//!   (x = 0). The reference level is toe level behind the toe and the original ground in front of it, so that the
//!   material's heights above it are those above the ground that it slides on, level or not. Contiguous are the points
//!   above the reference level in occupied cells (of the grid, moved up or down with that level) that are joined
//!   through cell sides to the slope's own body behind the toe, and those of a slide that has torn off it, if more points
//!   went than stayed; sprayed points are not, and a foundation that heaves in front of the toe does not advance it.
//! * Crest retreat: largest distance behind the crest edge at which a point of the original ground surface moved
//!   more than the threshold.
//! * Moved area: present volume of the points with |u| above the threshold.
//! * Deposit height at the toe: top of the contiguous material in the first cell column in front of the toe, above the
//!   reference level.

use crate::campaign::{Mesh, Slope};
use crate::gimp::Grid;
use crate::outcome::Measures;
use crate::slope;

/// The points at the end and where they were at the start of failure; equal lengths, m and m2.
#[derive(Debug, Clone, Copy)]
pub struct Moved<'a> {
    /// Positions before.
    pub x0: &'a [f64],
    /// Positions before.
    pub y0: &'a [f64],
    /// Positions now.
    pub x: &'a [f64],
    /// Positions now.
    pub y: &'a [f64],
    /// Volumes now.
    pub volume: &'a [f64],
}

/// Measures `moved` on the grid of the slope; `threshold_m` says what counts as moved.
pub fn measure(
    moved: &Moved<'_>,
    slope: &Slope,
    mesh: &Mesh,
    threshold_m: f64,
    time_to_rest_s: Option<f64>,
) -> Measures {
    let displacement: Vec<f64> = (0..moved.x.len())
        .map(|i| {
            let (dx, dy) = (moved.x[i] - moved.x0[i], moved.y[i] - moved.y0[i]);
            (dx * dx + dy * dy).sqrt()
        })
        .collect();
    let mut sorted = displacement.clone();
    sorted.sort_by(f64::total_cmp);
    let half = 0.5 * mesh.point_spacing_m();
    let edge = slope::crest_edge_x(slope);
    // Ground points are those whose centre is less than a spacing below the ground.
    let surface = |x: f64| slope::ground_surface_y(slope, x) - mesh.point_spacing_m();
    let above = |x: &[f64], y: &[f64]| -> Vec<f64> {
        x.iter().zip(y).map(|(&x, &y)| y - slope::reference_y(slope, x)).collect()
    };
    let (height0, height) = (above(moved.x0, moved.y0), above(moved.x, moved.y));

    let contiguous = contiguous(moved.x, &height, &slope::grid(slope, mesh));
    let joined = || (0..moved.x.len()).filter(|&i| contiguous[i]);
    let front = joined().filter(|&i| height0[i] >= 0.0).map(|i| moved.x[i] + half).fold(0.0, f64::max);
    let at_toe = joined()
        .filter(|&i| moved.x[i] >= 0.0 && moved.x[i] < mesh.cell_size_m)
        .map(|i| height[i] + half)
        .fold(0.0, f64::max);
    let gone = || (0..moved.x.len()).filter(|&i| displacement[i] > threshold_m);
    Measures {
        max_displacement_m: sorted.last().copied().unwrap_or(0.0),
        displacement_q999_m: quantile(&sorted, 0.999),
        toe_advance_m: front,
        crest_retreat_m: gone()
            .filter(|&i| moved.x0[i] < edge && moved.y0[i] > surface(moved.x0[i]))
            .map(|i| edge - moved.x0[i] + half)
            .fold(0.0, f64::max),
        moved_area_m2: gone().map(|i| moved.volume[i]).sum(),
        deposit_height_at_toe_m: at_toe,
        time_to_rest_s,
    }
}

/// Quantile of sorted values, type 7 of Hyndman & Fan (1996); 0 of nothing.
fn quantile(sorted: &[f64], p: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else {
        return 0.0;
    };
    let place = p * last as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(last);
    sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
}

/// Which points above the reference level lie in cells joined through their sides to the slope's body: to the occupied
/// cells behind the toe in the row of cells above toe level; and in the largest other group of cells, if it holds more
/// points than the body: a slide that has torn off is no spray. `height`: of the points, above the reference level.
fn contiguous(x: &[f64], height: &[f64], grid: &Grid) -> Vec<bool> {
    let [nx, ny] = grid.nodes;
    let cells: Vec<Option<usize>> =
        x.iter().zip(height).map(|(&x, &y)| (y >= 0.0).then(|| grid.cell_of(x, y))).collect();
    let mut points = vec![0_usize; nx * ny];
    cells.iter().flatten().for_each(|&cell| points[cell] += 1);

    // The middles of the lowest row above toe level, from the left wall to the toe.
    let lowest = grid.cell_of(0.0, 0.5 * grid.cell_m) / nx;
    let toe = grid.cell_of(-0.5 * grid.cell_m, 0.5 * grid.cell_m) % nx;
    let mut reached = vec![false; nx * ny];
    let mut body: Vec<usize> =
        (0..=toe).flat_map(|i| join(lowest * nx + i, &points, nx, &mut reached)).collect();
    let size = |group: &[usize]| group.iter().map(|&cell| points[cell]).sum::<usize>();
    let mut largest = Vec::new();
    for cell in 0..nx * ny {
        let group = join(cell, &points, nx, &mut reached);
        if size(&group) > size(&largest) {
            largest = group;
        }
    }
    if size(&largest) > size(&body) {
        body.extend(largest);
    }
    let mut is_body = vec![false; nx * ny];
    body.into_iter().for_each(|cell| is_body[cell] = true);
    cells.into_iter().map(|cell| cell.is_some_and(|c| is_body[c])).collect()
}

/// The cells with points that are joined to `start`, itself included, and were not `reached` before; `points`: per cell,
/// rows of `nx`.
fn join(start: usize, points: &[usize], nx: usize, reached: &mut [bool]) -> Vec<usize> {
    let (mut group, mut waiting) = (Vec::new(), vec![start]);
    while let Some(cell) = waiting.pop() {
        if points[cell] == 0 || std::mem::replace(&mut reached[cell], true) {
            continue;
        }
        group.push(cell);
        let i = cell % nx;
        let sides = [
            (i > 0).then(|| cell - 1),
            (i + 1 < nx).then(|| cell + 1),
            cell.checked_sub(nx),
            Some(cell + nx).filter(|above| *above < points.len()),
        ];
        waiting.extend(sides.into_iter().flatten());
    }
    group
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points;
    use crate::slope::tests::{surveyed, uniform};

    const SLOPE: Slope = uniform(4.0, std::f64::consts::FRAC_PI_4, 4.0, 8.0);
    const MESH: Mesh = Mesh { cell_size_m: 1.0, points_per_cell_side: 2 };

    fn measured(change: impl Fn(usize, &mut f64, &mut f64)) -> Measures {
        measured_on(&SLOPE, change)
    }

    fn measured_on(slope: &Slope, change: impl Fn(usize, &mut f64, &mut f64)) -> Measures {
        let points = points::fill(slope, &MESH);
        let (mut x, mut y) = (points.x.clone(), points.y.clone());
        for i in 0..x.len() {
            change(i, &mut x[i], &mut y[i]);
        }
        let volume = vec![0.25; x.len()];
        let moved = Moved { x0: &points.x, y0: &points.y, x: &x, y: &y, volume: &volume };
        measure(&moved, slope, &MESH, 0.1, Some(1.0))
    }

    #[test]
    fn nothing_moved_measures_zero() {
        let m = measured(|_, _, _| {});
        assert_eq!([m.max_displacement_m, m.displacement_q999_m, m.toe_advance_m], [0.0; 3]);
        assert_eq!([m.crest_retreat_m, m.moved_area_m2, m.deposit_height_at_toe_m], [0.0; 3]);
    }

    #[test]
    fn a_block_slide_moves_everything_by_its_shift() {
        let m = measured(|_, x, _| *x += 2.0);
        assert_eq!(m.max_displacement_m, 2.0);
        assert_eq!(m.displacement_q999_m, 2.0);
        assert!((m.toe_advance_m - 2.0).abs() < 1e-12);
        assert!((m.crest_retreat_m - 4.0).abs() < 1e-12);
        assert!((m.deposit_height_at_toe_m - 2.0).abs() < 0.51, "{m:?}");
    }

    #[test]
    fn a_body_that_has_left_its_place_counts_if_more_went_than_stayed() {
        let all_but_one = measured(|i, x, _| *x += if i == 0 { 15.5 } else { 9.0 });
        assert!((all_but_one.toe_advance_m - 9.0).abs() < 1e-12, "{all_but_one:?}");
        // The slope's front 6 m2 of 24, then its front 18.
        let slid = |behind: f64| measured(move |_, x, _| *x += if *x > behind { 6.0 } else { 0.0 });
        assert_eq!(slid(-2.5).toe_advance_m, 0.0);
        assert!((slid(-6.0).toe_advance_m - 6.0).abs() < 1e-12);
    }

    #[test]
    fn a_sprayed_point_counts_for_the_maximum_only() {
        let m = measured(|i, x, _| *x += if i == 0 { 14.0 } else { 0.0 });
        assert_eq!(m.max_displacement_m, 14.0);
        assert_eq!(m.toe_advance_m, 0.0);
        assert_eq!(m.moved_area_m2, 0.25);
    }

    /// A slope whose ground in front of the toe falls by 2 m in 8 m and whose crest falls towards the edge.
    fn falling() -> Slope {
        surveyed(&[[-8.0, 5.0], [-4.0, 4.0], [0.0, 0.0], [8.0, -2.0]], -4.0, 3.0, 12.0)
    }

    #[test]
    fn ground_in_front_of_the_toe_is_no_front_wherever_it_lies() {
        let rising = surveyed(&[[-8.0, 4.0], [-4.0, 4.0], [0.0, 0.0], [8.0, 2.0]], -4.0, 3.0, 12.0);
        for slope in [falling(), rising] {
            let m = measured_on(&slope, |_, _, _| {});
            assert_eq!(
                [m.toe_advance_m, m.crest_retreat_m, m.deposit_height_at_toe_m],
                [0.0; 3],
                "{slope:?}"
            );
            // Heave of the ground in front is no front either.
            let m = measured_on(&slope, |_, x, y| *y += if *x > 0.0 { 0.4 } else { 0.0 });
            assert_eq!(m.toe_advance_m, 0.0, "{slope:?}");
        }
    }

    /// Everything above toe level moved 6 m ahead and laid on the falling ground, 1.5 m below toe level at its front: it
    /// counts, although the cells at toe level there are empty.
    #[test]
    fn a_slide_down_falling_ground_is_contiguous_along_it() {
        let slope = falling();
        let slid = |_: usize, x: &mut f64, y: &mut f64| {
            if *x < 0.0 && *y >= 0.0 {
                *x += 6.0;
                // On the ground: as high above it as it was above toe level.
                *y += slope::reference_y(&slope, *x);
            }
        };
        let m = measured_on(&slope, slid);
        // The lowest row's front was at the toe.
        assert!((m.toe_advance_m - 6.0).abs() < 1e-12, "{m:?}");
        assert!((m.crest_retreat_m - 4.0).abs() < 1e-12, "{m:?}");
    }

    #[test]
    fn quantiles_follow_type_seven() {
        let values: Vec<f64> = (0..=1000).map(f64::from).collect();
        assert_eq!(quantile(&values, 0.999), 999.0);
        assert!((quantile(&[0.0, 1.0], 0.999) - 0.999).abs() < 1e-15);
        assert_eq!(quantile(&[], 0.999), 0.0);
    }
}
