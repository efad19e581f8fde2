//! What an analysis is set up from.

use super::grid::Grid;
use crate::campaign::{Formulation, VolumetricStrain};

/// How a wall of the grid holds the material (skeleton and water alike).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Support {
    /// Not at all.
    Open,
    /// Its normal velocity is zero.
    Roller,
    /// Its velocity is zero.
    Fixed,
    /// It is touched from above, with Coulomb friction of this coefficient (only the bottom wall, only one phase).
    Friction(f64),
}

/// Walls, gravity and ground surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conditions {
    /// Wall at the smallest x.
    pub left: Support,
    /// Wall at the largest x.
    pub right: Support,
    /// Wall at the smallest y.
    pub bottom: Support,
    /// Wall at the largest y.
    pub top: Support,
    /// Gravity vector, m/s2.
    pub gravity_m_s2: [f64; 2],
    /// Whether water cannot pass the ground surface: at nodes less than three quarters full it then moves with
    /// the skeleton. Otherwise the pore pressure is zero there in the natural way: nothing pushes from outside.
    pub closed_surface: bool,
}

/// Constants of the material, the same in every point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// Young's modulus of the skeleton, Pa.
    pub youngs_modulus_pa: f64,
    /// Poisson's ratio of the skeleton.
    pub poissons_ratio: f64,
    /// Dilation angle, rad.
    pub dilation_angle_rad: f64,
    /// Tension cut-off, Pa; absent: the apex alone limits tension.
    pub tension_cutoff_pa: Option<f64>,
    /// Porosity at the start.
    pub porosity: f64,
    /// Hydraulic conductivity, m/s.
    pub permeability_m_s: f64,
    /// Density of the water, kg/m3.
    pub water_density_kg_m3: f64,
    /// Bulk modulus of the water, Pa.
    pub water_bulk_modulus_pa: f64,
    /// Largest suction the water can carry, Pa.
    pub cavitation_suction_pa: f64,
    /// Gravity that relates hydraulic conductivity to drag, m/s2.
    pub gravity_m_s2: f64,
}

/// Numerical choices that move the answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Controls {
    /// One or two phases.
    pub formulation: Formulation,
    /// Which volumetric strain increment the stresses see.
    pub volumetric_strain: VolumetricStrain,
    /// Rate at which a point's pore pressure relaxes to its cell's mean, 1/s.
    pub pressure_relaxation_rate_per_s: f64,
    /// Rate at which point velocities relax to the grid's, 1/s.
    pub pic_rate_per_s: f64,
    /// Local damping, share of the unbalanced force.
    pub local_damping: f64,
    /// Time step over the critical one.
    pub courant_number: f64,
}

/// The material points at the start, one entry each; plane strain, per metre of width.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct InitialPoints {
    /// Position, m.
    pub x: Vec<f64>,
    /// Position, m.
    pub y: Vec<f64>,
    /// Velocity of skeleton and water, m/s.
    pub velocity: Vec<[f64; 2]>,
    /// Volume, m2.
    pub volume: Vec<f64>,
    /// Density of the whole (grains and water), kg/m3.
    pub density: Vec<f64>,
    /// Effective stress xx, yy, zz, xy (total, if there is one phase), tension positive, Pa.
    pub stress: Vec<[f64; 4]>,
    /// Pore pressure, Pa.
    pub pressure: Vec<f64>,
    /// Cohesion, Pa; infinite for an elastic material.
    pub cohesion: Vec<f64>,
    /// Friction angle, rad.
    pub friction_angle: Vec<f64>,
}

impl InitialPoints {
    /// Points at rest, unstressed and elastic, all of one volume and density.
    pub fn at_rest(positions: &[[f64; 2]], volume: f64, density: f64) -> InitialPoints {
        let n = positions.len();
        InitialPoints {
            x: positions.iter().map(|p| p[0]).collect(),
            y: positions.iter().map(|p| p[1]).collect(),
            velocity: vec![[0.0; 2]; n],
            volume: vec![volume; n],
            density: vec![density; n],
            stress: vec![[0.0; 4]; n],
            pressure: vec![0.0; n],
            cohesion: vec![f64::INFINITY; n],
            friction_angle: vec![0.0; n],
        }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }
}

/// Everything an analysis is set up from.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// Grid.
    pub grid: Grid,
    /// Points per cell and direction: a point's length is a cell's side over this.
    pub points_per_cell_side: u32,
    /// Walls, gravity, ground surface.
    pub conditions: Conditions,
    /// Material constants.
    pub material: Material,
    /// Numerical choices.
    pub controls: Controls,
    /// Material points.
    pub points: InitialPoints,
}
