//! What the solver is set up from: the spec's grid, walls, obstacles, materials and numerical choices.

use super::Prepared;
use crate::campaign::{Contact, Formulation, GroundSurface, Model, Soil};
use crate::gimp::{
    Conditions, Controls, Fluid, InitialPoints, Material, Obstacle, Setup, Softening, Support,
};

impl Prepared {
    /// The failure stage: the spec with these points; rollers left and right.
    pub(super) fn failure_setup(&self, points: InitialPoints) -> Setup {
        let Model { slope, obstacles, mesh, water, analysis, .. } = &self.spec.model;
        Setup {
            grid: self.grid,
            points_per_cell_side: mesh.points_per_cell_side,
            conditions: Conditions {
                left: Support::Roller,
                right: Support::Roller,
                bottom: support(slope.base),
                top: Support::Open,
                gravity_m_s2: [0.0, -analysis.gravity_m_s2],
                closed_surface: water.ground_surface == GroundSurface::Closed,
                free_water_level_m: water.free_water_level_m,
            },
            obstacles: obstacles
                .iter()
                .map(|o| Obstacle { x_m: o.x_m, y_m: o.y_m, support: support(o.contact) })
                .collect(),
            fluid: Fluid {
                density_kg_m3: water.density_kg_m3,
                bulk_modulus_pa: water.bulk_modulus_pa,
                cavitation_suction_pa: water.cavitation_suction_pa,
                gravity_m_s2: analysis.gravity_m_s2,
            },
            materials: self.spec.model.materials().into_iter().map(material).collect(),
            controls: Controls {
                formulation: analysis.formulation,
                volumetric_strain: analysis.volumetric_strain,
                pressure_relaxation_rate_per_s: analysis.pressure_relaxation_rate_per_s,
                pic_rate_per_s: analysis.pic_rate_per_s,
                velocity_filter: analysis.velocity_filter,
                local_damping: analysis.local_damping,
                damping_rate_per_s: analysis.damping_rate_per_s,
                point_domain: analysis.point_domain,
                courant_number: analysis.courant_number,
            },
            points,
        }
    }

    /// The gravity stage: as the failure stage, but of one phase, more damped, on a fixed base and without what came
    /// after the ground: obstacles. Free water is in the points' weight.
    pub(super) fn gravity_setup(&self, points: InitialPoints) -> Setup {
        let mut setup = self.failure_setup(points);
        setup.controls.formulation = Formulation::OnePhase;
        setup.controls.local_damping = self.spec.model.analysis.gravity_stage_damping;
        setup.conditions.bottom = Support::Fixed;
        setup.conditions.free_water_level_m = None;
        setup.obstacles.clear();
        setup
    }
}

fn support(contact: Contact) -> Support {
    match contact {
        Contact::Fixed => Support::Fixed,
        Contact::Friction(coefficient) => Support::Friction(coefficient),
    }
}

fn material(soil: &Soil) -> Material {
    Material {
        youngs_modulus_pa: soil.youngs_modulus_pa,
        poissons_ratio: soil.poissons_ratio,
        dilation_angle_rad: soil.dilation_angle_rad,
        tension_cutoff_pa: soil.tension_cutoff_pa,
        softening: soil.softening.map(|s| Softening {
            residual_cohesion: s.residual_cohesion_ratio,
            residual_friction_angle: s.residual_friction_ratio,
            residual_dilation_angle: s.residual_dilation_ratio,
            displacement_m: s.displacement_m,
        }),
        porosity: soil.porosity,
        permeability_m_s: soil.permeability_m_s,
    }
}
