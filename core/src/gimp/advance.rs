//! One time step of MUSL: the phases in order, each over all its parts.
//!
//! Order: (scatter) - momentum balance - (filter) - gather and second scatter - velocities - gradients - cell means -
//! stress, pore pressure, volume and move - scatter for the next step. The last two are one pass over the points.

use super::balance::Balance;
use super::block::{Block, Extra};
use super::grid::Grid;
use super::kernel::Build;
use super::loads::Loads;
use super::momentum::NodeWork;
use super::nodes::Nodes;
use super::phase::{Phase, Tally};
use super::plan::{Chunk, Plan};
use super::strain::Averaging;
use super::water::PoreWater;
use super::window::{Points, Window};
use std::ops::Range;

/// The points and grid of an analysis.
#[derive(Debug, Clone)]
pub(super) struct Arena {
    pub(super) grid: Grid,
    pub(super) blocks: Vec<Block>,
    /// As many as `blocks`, or none if the step needs none.
    pub(super) extras: Vec<Extra>,
    /// Points in the last block that are real.
    pub(super) live_in_last: usize,
    pub(super) nodes: Nodes,
    pub(super) plan: Plan,
    /// Whether `nodes.sums` holds the scatter of the points' present state.
    pub(super) scattered: bool,
}

impl Arena {
    /// Forgets the scatter of the points' present state: what acts on them has changed.
    pub(super) fn rescatter(&mut self) {
        self.nodes.clear();
        self.scattered = false;
    }
}

/// Constants of one step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    pub(super) dt: f64,
    /// Share of the filtered part of the velocities that decays.
    pub(super) pic: f64,
    /// Whether the filter is applied twice.
    pub(super) filter_twice: bool,
    /// Whether stresses see the cell's mean volumetric strain.
    pub(super) average_strain: bool,
    /// Half the side of a point's domain at the start, in cells.
    pub(super) half_length: f64,
    /// Whether the points' domains follow their stretch.
    pub(super) stretch: bool,
    /// Whether some point's strength softens.
    pub(super) soften: bool,
    pub(super) balance: Balance,
    pub(super) averaging: Averaging,
    pub(super) loads: Option<Loads>,
    pub(super) water: PoreWater,
}

impl Step {
    /// How means over cells are taken, if they are needed.
    #[inline(always)]
    pub(super) fn average(&self, two: bool) -> Option<&Averaging> {
        (self.average_strain || (two && self.water.relaxation > 0.0)).then_some(&self.averaging)
    }
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
    /// Work at the nodes.
    pub(super) nodes: NodeWork,
    /// Kinetic energy that the velocity filter took, J per m.
    pub(super) filtered: f64,
    /// Work of the effective stresses on the skeleton's strain, J per m.
    pub(super) stress_work: f64,
    /// Work that compressed the pore water, J per m.
    pub(super) water_work: f64,
}

/// Carries the arena through one step; with `side_by_side`, the parts of a phase in the threads of the current pool.
pub(super) fn advance(arena: &mut Arena, build: Build, step: &Step, side_by_side: bool) -> StepReport {
    let filter = step.filter_twice;
    let average = step.average(build.two).is_some();
    let phases = [
        (!arena.scattered, Phase::Scatter),
        (true, Phase::Balance),
        (filter, Phase::Filter),
        (filter, Phase::FilteredVelocities),
        (true, Phase::Gather),
        (true, Phase::Velocities),
        (true, Phase::Gradients),
        (average, Phase::Means),
        (true, Phase::Update),
    ];
    let mut tally = Tally::default();
    for (_, phase) in phases.into_iter().filter(|(needed, _)| *needed) {
        tally = tally.and(run(arena, &Job { build, phase, step, side_by_side }));
    }
    arena.scattered = true;
    StepReport {
        kinetic_energy: 0.5 * tally.double_energy,
        fastest: tally.fastest_squared.sqrt(),
        left_grid: tally.outside,
        nodes: tally.nodes,
        filtered: 0.5 * tally.double_loss,
        stress_work: tally.stress_work,
        water_work: tally.water_work,
    }
}

/// A phase to be run.
struct Job<'a> {
    build: Build,
    phase: Phase,
    step: &'a Step,
    side_by_side: bool,
}

/// One phase over all its parts.
fn run(arena: &mut Arena, job: &Job<'_>) -> Tally {
    let Arena { grid, blocks, extras, nodes, plan, .. } = arena;
    if matches!(job.phase, Phase::Balance | Phase::FilteredVelocities | Phase::Velocities | Phase::Means) {
        let spans = std::mem::take(&mut nodes.spans);
        let tally = job.at_nodes(grid, &spans, &plan.bands, Window::all(nodes));
        nodes.spans = spans;
        return tally;
    }
    let mut tally = Tally::default();
    for chunks in &plan.colours {
        let points = Points { first: 0, blocks, extras };
        tally = tally.and(job.at_points(grid, chunks, points, Window::all(nodes)));
    }
    tally
}

impl Job<'_> {
    /// Over chunks that touch no node in common, in halves of halves: the order of the sums hangs on their number only.
    fn at_points(&self, grid: &Grid, chunks: &[Chunk], points: Points<'_>, nodes: Window<'_>) -> Tally {
        let stride = grid.nodes[0];
        match chunks {
            [] => Tally::default(),
            [chunk] => {
                let mut nodes = nodes.only(chunk.rows.start * stride..chunk.rows.end * stride);
                let points = points.only(&chunk.blocks);
                self.build.at_points(self.phase, grid, self.step, &chunk.rows, points, &mut nodes)
            }
            _ => {
                let (left, right) = chunks.split_at(chunks.len() / 2);
                let (left_points, right_points) = points.split_at(right[0].blocks.start);
                let (left_nodes, right_nodes) = nodes.split_at(right[0].rows.start * stride);
                let (a, b) = self.both(
                    || self.at_points(grid, left, left_points, left_nodes),
                    || self.at_points(grid, right, right_points, right_nodes),
                );
                a.and(b)
            }
        }
    }

    /// Over bands of rows of nodes.
    fn at_nodes(
        &self,
        grid: &Grid,
        spans: &[Range<usize>],
        bands: &[Range<usize>],
        nodes: Window<'_>,
    ) -> Tally {
        let stride = grid.nodes[0];
        match bands {
            [] => Tally::default(),
            [band] => {
                let mut nodes = nodes.only(band.start * stride..band.end * stride);
                self.build.at_nodes(self.phase, self.step, &spans[band.clone()], &mut nodes)
            }
            _ => {
                let (left, right) = bands.split_at(bands.len() / 2);
                let (left_nodes, right_nodes) = nodes.split_at(right[0].start * stride);
                let (a, b) = self.both(
                    || self.at_nodes(grid, spans, left, left_nodes),
                    || self.at_nodes(grid, spans, right, right_nodes),
                );
                a.and(b)
            }
        }
    }

    fn both(
        &self,
        left: impl FnOnce() -> Tally + Send,
        right: impl FnOnce() -> Tally + Send,
    ) -> (Tally, Tally) {
        if self.side_by_side { rayon::join(left, right) } else { (left(), right()) }
    }
}
