//! What an analysis is set up from.

use super::grid::Grid;
use crate::campaign::{Formulation, PointDomain, VelocityFilter, VolumetricStrain};

/// How a wall of the grid holds the material (skeleton and water alike).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Support {
    /// Not at all.
    Open,
    /// Its normal velocity is zero.
    Roller,
    /// Its velocity is zero.
    Fixed,
    /// It is touched from inside with Coulomb friction of this coefficient and cannot pull; water does not pass it.
    Friction(f64),
}

/// A rigid rectangle on the grid, its sides moved to the nearest nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Obstacle {
    /// Smallest and largest x, m.
    pub x_m: [f64; 2],
    /// Smallest and largest y, m.
    pub y_m: [f64; 2],
    /// How its sides hold the material: [`Support::Fixed`] or [`Support::Friction`].
    pub support: Support,
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
    /// the skeleton. Otherwise the pore pressure is that of the free water there, zero without any, in the natural way.
    pub closed_surface: bool,
    /// Elevation of standing free water outside the soil, m; absent: there is none. Two phases only. Its pressure acts on
    /// the ground surface, and what slides into it is buoyant; its own motion and drag are left out.
    pub free_water_level_m: Option<f64>,
}

/// The pore water and the free water.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fluid {
    /// Density, kg/m3.
    pub density_kg_m3: f64,
    /// Bulk modulus, Pa.
    pub bulk_modulus_pa: f64,
    /// Largest suction that pore water can carry, Pa.
    pub cavitation_suction_pa: f64,
    /// Gravity that relates hydraulic conductivity to drag, m/s2.
    pub gravity_m_s2: f64,
}

/// Exponential decay of strength with plastic strain, regularised by the size of a cell.
///
/// With d = sqrt(3) eps h the shear displacement across a band one cell h wide (eps the equivalent deviatoric plastic
/// strain, which in simple shear is the engineering strain over sqrt(3)), cohesion, friction angle and dilation
/// angle go from their peak to `residual` times it as exp(-d / `displacement_m`). Exponential form: Yerro, Alonso &
/// Pinyol (2016), "Run-out of landslides in brittle soils", Computers and Geotechnics 80:427; regularisation: the
/// crack band model of Bazant & Oh (1983), with a shear displacement in place of a crack opening.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Softening {
    /// Residual over peak cohesion, in [0, 1].
    pub residual_cohesion: f64,
    /// Residual over peak friction angle, in [0, 1].
    pub residual_friction_angle: f64,
    /// Residual over peak dilation angle, in [0, 1].
    pub residual_dilation_angle: f64,
    /// Shear displacement across a band over which the difference to the residual falls to 1/e, m.
    pub displacement_m: f64,
}

/// Constants of one material.
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
    /// Decay of strength; absent: perfectly plastic.
    pub softening: Option<Softening>,
    /// Porosity at the start.
    pub porosity: f64,
    /// Hydraulic conductivity, m/s.
    pub permeability_m_s: f64,
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
    /// Rate at which the filtered part of the point velocities decays, 1/s.
    pub pic_rate_per_s: f64,
    /// Which part of the point velocities that is.
    pub velocity_filter: VelocityFilter,
    /// Local damping, share of the unbalanced force.
    pub local_damping: f64,
    /// Rate at which all velocities decay, 1/s.
    pub damping_rate_per_s: f64,
    /// Whether the points' domains follow their stretch.
    pub point_domain: PointDomain,
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
    /// Place of the point's material in [`Setup::materials`].
    pub material: Vec<u16>,
    /// Whether the skeleton holds the weight of the point's water (capillary water above a water table): the water
    /// then does not sink through the skeleton. Two phases only.
    pub water_held: Vec<bool>,
    /// External force on the mixture, N per m of width; [`super::Body::set_load_share`] says how much of it acts.
    pub force: Vec<[f64; 2]>,
}

impl InitialPoints {
    /// Points at rest, unstressed, elastic, of the first material, all of one volume and density; the water has weight.
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
            material: vec![0; n],
            water_held: vec![false; n],
            force: vec![[0.0; 2]; n],
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
    /// Rigid obstacles.
    pub obstacles: Vec<Obstacle>,
    /// Pore water and free water.
    pub fluid: Fluid,
    /// Constants of each material, at least one.
    pub materials: Vec<Material>,
    /// Numerical choices.
    pub controls: Controls,
    /// Material points.
    pub points: InitialPoints,
}

impl Setup {
    /// Constants of the material of point `i`.
    pub(super) fn material_of(&self, i: usize) -> &Material {
        &self.materials[usize::from(self.points.material[i])]
    }
}
