//! What acts on points besides stress and their own weight: free water outside the soil, water that the skeleton holds,
//! external forces; and the drag coefficient where it differs from point to point.
//!
//! Standing free water up to a level presses on the ground with P = rho_w g (level - y). Written in p - P, the excess
//! over it, the balances need no traction on the ground surface: the mixture loses the weight of the water it
//! displaces, the pore water all of its weight, and p = P at the surface is the natural condition. A point that
//! straddles the level is submerged in part; P is then its mean over the point.

use super::block::{Block, Extra};
use super::grid::GridLanes;
use super::lanes::{Lanes, V8};
use super::shape::Shape;
use super::transfer::{self, Values};

/// Constants of a step's loads.
#[derive(Debug, Clone, Copy)]
pub(super) struct Loads {
    /// Share of the external forces that acts.
    pub(super) share: f64,
    /// Gravity vector, m/s2.
    pub(super) gravity: [f64; 2],
    /// Density of the water, kg/m3.
    pub(super) water_density: f64,
    /// Level of the free water, m; minus infinity if there is none.
    pub(super) free_water_level: f64,
}

impl Loads {
    /// Pressure of the free water on eight points, Pa, and the share of each that is submerged.
    #[inline(always)]
    pub(super) fn free_water<S: Lanes>(&self, grid: &GridLanes<S>, block: &Block, extra: &Extra) -> (S, S) {
        let (zero, one, half) = (S::splat(0.0), S::splat(1.0), S::splat(0.5));
        let height = (S::load(&extra.half_y) + S::load(&extra.half_y)) * grid.cell;
        let depth = S::splat(self.free_water_level) - S::load(&block.y);
        let share = (depth / height + half).max(zero).min(one);
        let covered = share.gt(S::splat(1.0 - f64::EPSILON));
        let mean_depth = S::select(covered, depth, share * share * height * half);
        let weight = S::splat(-self.gravity[1] * self.water_density);
        (weight * mean_depth, share)
    }

    /// Adds drag coefficients, and forces on mixture and water that act besides their weights, to the nodes.
    #[inline(always)]
    pub(super) fn scatter<S: Lanes, const TWO: bool>(
        &self,
        grid: &GridLanes<S>,
        stride: usize,
        block: &Block,
        extra: &Extra,
        shape: &Shape,
        nodes: &mut [V8],
    ) {
        let zero = S::splat(0.0);
        let load_share = S::splat(self.share);
        let mut mixture = [load_share * S::load(&extra.force_x), load_share * S::load(&extra.force_y)];
        let mut water = [zero; 2];
        let mut drag = zero;
        if TWO {
            let density = S::splat(self.water_density);
            let volume = S::load(&block.volume);
            let pores = volume - S::load(&block.grains);
            let water_mass = pores * density;
            let porosity = pores / volume.max(S::splat(f64::MIN_POSITIVE));
            drag = S::load(&extra.drag_rate) * porosity * water_mass;
            let (_, submerged) = self.free_water(grid, block, extra);
            let displaced = submerged * volume * density;
            let carried = submerged.max(S::load(&extra.held)) * water_mass;
            for axis in 0..2 {
                let gravity = S::splat(self.gravity[axis]);
                mixture[axis] = mixture[axis] - gravity * displaced;
                water[axis] = -(gravity * carried);
            }
        }
        let rows = [drag, mixture[0], mixture[1], water[0], water[1], zero, zero, zero];
        transfer::add::<S>(&transfer::rows(rows), &Values(shape), stride, nodes);
    }
}
