//! One time step of MUSL, for eight points at a time; compiled once per kernel and formulation.
//!
//! Order: (scatter) - momentum balance - gather and second scatter - velocities - gradients - cell means - stress,
//! pore pressure, volume and move - scatter for the next step. The last two are one pass over the points.

use super::block::Block;
use super::gather::{self, Blend, Motion};
use super::grid::{Grid, GridLanes};
use super::lanes::{Lanes, V8};
use super::momentum::{self, Balance};
use super::nodes::Nodes;
use super::scatter;
use super::soil::{self, Elastic, Increment, Strength, Stress};
use super::strain;
use super::water::{self, PoreWater};

/// The points and grid of an analysis.
#[derive(Debug, Clone)]
pub(super) struct Arena {
    pub(super) grid: Grid,
    /// Half a point's length over a cell's side.
    pub(super) half_length: f64,
    pub(super) blocks: Vec<Block>,
    /// Points in the last block that are real.
    pub(super) live_in_last: usize,
    pub(super) nodes: Nodes,
    /// Whether `nodes.sums` holds the scatter of the points' present state.
    pub(super) scattered: bool,
}

/// Constants of one step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    pub(super) dt: f64,
    pub(super) pic: f64,
    /// Whether stresses see the cell's mean volumetric strain.
    pub(super) average_strain: bool,
    pub(super) balance: Balance,
    pub(super) water: PoreWater,
}

/// What a step tells.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepReport {
    /// Kinetic energy of both phases, J per m of width.
    pub(super) kinetic_energy: f64,
    /// Largest speed of a point, m/s.
    pub(super) fastest: f64,
    /// Whether a point has left the grid.
    pub(super) left_grid: bool,
}

/// Carries the arena through one step.
#[inline(always)]
pub(super) fn advance<S: Lanes, const TWO: bool>(arena: &mut Arena, step: &Step) -> StepReport {
    let Arena { grid, half_length, blocks, live_in_last, nodes, scattered } = arena;
    let lanes = GridLanes::<S>::new(grid, *half_length);
    let stride = grid.nodes[0];
    let water_density = S::splat(step.balance.water_density);
    let dt = S::splat(step.dt);
    let zero = S::splat(0.0);

    if !*scattered {
        for block in blocks.iter() {
            scatter::scatter::<S, TWO>(&lanes, stride, water_density, block, nodes);
        }
    }
    momentum::accelerate::<TWO>(nodes, &step.balance, step.dt);

    let blend = Blend { dt, pic: S::splat(step.pic), water_density };
    let mut motion = Motion { double_energy: zero, fastest: zero };
    for block in blocks.iter_mut() {
        gather::gather_and_scatter_again::<S, TWO>(&lanes, stride, &blend, block, nodes, &mut motion);
    }
    if let Some(last) = blocks.last_mut() {
        rest_padding(last, *live_in_last);
    }
    momentum::velocities::<TWO>(nodes, &step.balance);

    let average = step.average_strain || (TWO && step.water.relaxation > 0.0);
    for block in blocks.iter_mut() {
        strain::gradients::<S, TWO>(&lanes, stride, dt, average, block, nodes);
    }
    if average {
        strain::average_cells(nodes);
    }

    let mut outside = zero;
    for block in blocks.iter_mut() {
        let gone = update::<S, TWO>(&lanes, step, average, block, &nodes.cells);
        outside = outside.max(gone);
        scatter::scatter::<S, TWO>(&lanes, stride, water_density, block, nodes);
    }
    *scattered = true;
    report(motion, outside)
}

fn report<S: Lanes>(motion: Motion<S>, outside: S) -> StepReport {
    let lanes_of = |s: S| {
        let mut lanes = V8::ZERO;
        s.store(&mut lanes);
        lanes.0
    };
    StepReport {
        kinetic_energy: 0.5 * lanes_of(motion.double_energy).iter().sum::<f64>(),
        fastest: lanes_of(motion.fastest).iter().fold(0.0_f64, |a, &b| a.max(b)).sqrt(),
        left_grid: lanes_of(outside).iter().any(|&o| o > 0.0),
    }
}

/// Keeps the points that only fill the last block where they are.
fn rest_padding(last: &mut Block, live: usize) {
    for lane in live..8 {
        for quantity in [&mut last.vx, &mut last.vy, &mut last.wx, &mut last.wy, &mut last.dx, &mut last.dy] {
            quantity.0[lane] = 0.0;
        }
    }
}

/// Stress, pore pressure, volume and position of eight points; 1 in the lanes of points that left the grid.
#[inline(always)]
fn update<S: Lanes, const TWO: bool>(
    grid: &GridLanes<S>,
    step: &Step,
    average: bool,
    block: &mut Block,
    cells: &[V8],
) -> S {
    let load = |v: &V8| S::load(v);
    let one = S::splat(1.0);
    let means = if average { strain::cell_means(grid, block, cells) } else { [S::splat(0.0); 3] };
    let (xx, yy) = (load(&block.lxx), load(&block.lyy));
    let volumetric = if step.average_strain { means[0] } else { xx + yy };
    let increment = Increment { xx, yy, xy: load(&block.lxy), yx: load(&block.lyx), volumetric };
    let strength = Strength {
        sin_phi: load(&block.sin_phi),
        two_c_cos_phi: load(&block.two_c_cos_phi),
        apex: load(&block.apex),
        tension: load(&block.tension),
    };
    let elastic =
        Elastic { bulk: load(&block.bulk), shear: load(&block.shear), sin_psi: load(&block.sin_psi) };
    let stress =
        Stress { xx: load(&block.sxx), yy: load(&block.syy), zz: load(&block.szz), xy: load(&block.sxy) };
    let (stress, plastic) = soil::update(&elastic, &strength, stress, &increment);
    stress.xx.store(&mut block.sxx);
    stress.yy.store(&mut block.syy);
    stress.zz.store(&mut block.szz);
    stress.xy.store(&mut block.sxy);
    (load(&block.plastic_strain) + plastic).store(&mut block.plastic_strain);

    let volume = load(&block.volume);
    if TWO {
        let own = load(&block.water_divergence);
        let divergence = if step.average_strain { means[1] } else { own };
        let porosity = water::porosity(volume, load(&block.grains));
        let pressure = load(&block.pressure);
        let mean = if average { means[2] } else { pressure };
        water::pressure(&step.water, porosity, pressure, mean, volumetric, divergence)
            .store(&mut block.pressure);
    }
    (volume * (one + volumetric)).store(&mut block.volume);

    (load(&block.x) + load(&block.dx)).store(&mut block.x);
    (load(&block.y) + load(&block.dy)).store(&mut block.y);
    let [cx, cy] = grid.coordinates(&block.x, &block.y);
    let half = S::splat(0.5);
    let low = S::or(half.gt(cx), half.gt(cy));
    let high = S::or(cx.gt(grid.last_nearest[0] + half), cy.gt(grid.last_nearest[1] + half));
    S::select(S::or(low, high), one, S::splat(0.0))
}
