//! The points at the end of a step: stress, strength, pore pressure, volume, domain and place.

use super::advance::Step;
use super::block::{Block, Extra};
use super::grid::GridLanes;
use super::lanes::{Lanes, V8};
use super::soil::{self, Elastic, Increment, Strength, Stress};
use super::strain::{self, Averaging};
use super::water;

/// Half the side of a point's domain stays between these, in cells: where the shape functions hold, and above a tenth of
/// the usual size, below which they would be those of a point without extent.
const HALF_SIDE_CELLS: [f64; 2] = [0.025, 0.5];

/// What the pass adds up, lane by lane.
#[derive(Clone, Copy)]
pub(super) struct Moved<S> {
    /// Above zero in the lanes of points that left the grid.
    pub(super) outside: S,
    /// Work of the effective stresses on the skeleton's strain, J per m of width.
    pub(super) stress_work: S,
    /// Work that compressed the pore water, J per m.
    pub(super) water_work: S,
}

/// Brings eight points to the end of the step.
#[inline(always)]
pub(super) fn update<S: Lanes, const TWO: bool, const EXTRA: bool>(
    grid: &GridLanes<S>,
    step: &Step,
    average: Option<&Averaging>,
    block: &mut Block,
    mut extra: Option<&mut Extra>,
    cells: &[V8],
    tally: &mut Moved<S>,
) {
    let load = |v: &V8| S::load(v);
    let one = S::splat(1.0);
    let means = if average.is_some() { strain::cell_means(grid, block, cells) } else { [S::splat(0.0); 3] };
    let (xx, yy) = (load(&block.lxx), load(&block.lyy));
    let volumetric = if step.average_strain { means[0] } else { xx + yy };
    let increment = Increment { xx, yy, xy: load(&block.lxy), yx: load(&block.lyx), volumetric };
    let volume = load(&block.volume);
    tally.stress_work = volume
        .mul_add(update_stress::<S, EXTRA>(step, block, extra.as_deref_mut(), &increment), tally.stress_work);

    if TWO {
        let own = load(&block.water_divergence);
        let divergence = if step.average_strain { means[1] } else { own };
        let porosity = water::porosity(volume, load(&block.grains));
        let old = load(&block.pressure);
        let mean = match average {
            Some(averaging) => means[2] + averaging.hydrostatic::<S, EXTRA>(grid, block, extra.as_deref()),
            None => old,
        };
        let inflow = water::inflow(porosity, volumetric, divergence);
        let new = water::pressure(&step.water, porosity, old, mean, inflow);
        new.store(&mut block.pressure);
        let sum = water::acting(&step.water, old) + water::acting(&step.water, new);
        tally.water_work = (volume * S::splat(-0.5) * sum).mul_add(inflow, tally.water_work);
    }
    (volume * (one + volumetric)).store(&mut block.volume);
    if let Some(extra) = extra.filter(|_| EXTRA && step.stretch) {
        let (smallest, largest) = (S::splat(HALF_SIDE_CELLS[0]), S::splat(HALF_SIDE_CELLS[1]));
        let half_x = load(&extra.half_x) * (one + xx);
        let half_y = load(&extra.half_y) * (one + yy);
        half_x.max(smallest).min(largest).store(&mut extra.half_x);
        half_y.max(smallest).min(largest).store(&mut extra.half_y);
    }
    tally.outside = tally.outside.max(travel(grid, block));
}

/// New stress and strength; returns the work of the mean stress on the strain, J/m3.
#[inline(always)]
fn update_stress<S: Lanes, const EXTRA: bool>(
    step: &Step,
    block: &mut Block,
    extra: Option<&mut Extra>,
    increment: &Increment<S>,
) -> S {
    let softening = extra.filter(|_| EXTRA && step.soften);
    let load = |v: &V8| S::load(v);
    let (elastic, strength) = match &softening {
        Some(extra) => soil::softened(block, extra),
        None => (
            Elastic { bulk: load(&block.bulk), shear: load(&block.shear), sin_psi: load(&block.sin_psi) },
            Strength {
                sin_phi: load(&block.sin_phi),
                two_c_cos_phi: load(&block.two_c_cos_phi),
                apex: load(&block.apex),
                tension: load(&block.tension),
            },
        ),
    };
    let old =
        Stress { xx: load(&block.sxx), yy: load(&block.syy), zz: load(&block.szz), xy: load(&block.sxy) };
    let (new, plastic) = soil::update(&elastic, &strength, old, increment);
    new.xx.store(&mut block.sxx);
    new.yy.store(&mut block.syy);
    new.zz.store(&mut block.szz);
    new.xy.store(&mut block.sxy);
    (load(&block.plastic_strain) + plastic).store(&mut block.plastic_strain);
    if let Some(extra) = softening {
        let left = soil::decay(load(&extra.peak_left), load(&extra.softening_rate), plastic);
        left.store(&mut extra.peak_left);
    }
    soil::work(&old, &new, increment)
}

/// Moves eight points; 1 in the lanes of points that left the grid.
#[inline(always)]
fn travel<S: Lanes>(grid: &GridLanes<S>, block: &mut Block) -> S {
    let load = |v: &V8| S::load(v);
    (load(&block.x) + load(&block.dx)).store(&mut block.x);
    (load(&block.y) + load(&block.dy)).store(&mut block.y);
    let [cx, cy] = grid.coordinates(&block.x, &block.y);
    let half = S::splat(0.5);
    let low = S::or(half.gt(cx), half.gt(cy));
    let high = S::or(cx.gt(grid.last[0] + half), cy.gt(grid.last[1] + half));
    S::select(S::or(low, high), S::splat(1.0), S::splat(0.0))
}
