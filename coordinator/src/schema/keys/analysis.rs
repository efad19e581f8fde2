//! The description of `[analysis]`.

use super::needed;
use crate::schema::{Kind, NON_NEGATIVE, POSITIVE, Range, SHARE, Section, between};

const COURANT: Range = Range { low: Some((0.0, false)), high: Some((1.0, true)) };

/// `[analysis]`.
pub(super) const ANALYSIS: Section = Section {
    name: "analysis",
    header: "[analysis]",
    meaning: "Numerical analysis.",
    keys: &[
        needed(
            "formulation",
            Kind::Words(&["one-phase", "two-phase"]),
            "Total unit weight and no water, or skeleton and water.",
        ),
        needed("gravity_m_s2", Kind::Number(between(1e-3, 1e3)), "Gravity."),
        needed("courant_number", Kind::Number(COURANT), "Time step over the critical one."),
        needed(
            "volumetric_strain",
            Kind::Words(&["cell-average", "point"]),
            "Which volumetric strain increment the stresses see: the cell's mean (B-bar), or each point's own, which locks.",
        ),
        needed(
            "pressure_relaxation_rate_per_s",
            Kind::Number(NON_NEGATIVE),
            "Rate at which a point's pore pressure relaxes to its cell's mean; 0 for none.",
        ),
        needed(
            "pic_rate_per_s",
            Kind::Number(NON_NEGATIVE),
            "Rate at which point velocities relax to the grid's; 0 is pure FLIP. Damping moves the runout.",
        ),
        needed(
            "velocity_filter",
            Kind::Words(&["pic", "xpic"]),
            "Which part of the point velocities decays at that rate: all that the grid does not see, or the same filtered \
             twice, so that smooth motion loses less.",
        ),
        needed(
            "local_damping",
            Kind::Number(SHARE),
            "Local damping in the failure stage, as a share of the unbalanced force; 0 for none.",
        ),
        needed(
            "damping_rate_per_s",
            Kind::Number(NON_NEGATIVE),
            "Rate at which all velocities decay in the failure stage; 0 for none.",
        ),
        needed(
            "point_domain",
            Kind::Words(&["uniform", "stretched"]),
            "Whether the points' domains keep their size (uGIMP) or follow their stretch (cpGIMP).",
        ),
        needed(
            "initial_stress",
            Kind::Either(&[Kind::Words(&["gravity"]), Kind::With("k0", between(0.0, 5.0))]),
            "In-situ stresses: a stage of its own that brings the elastic, drained ground to rest under its weight; or k0, \
             horizontal over vertical effective stress, vertical from the column above. The latter is not in equilibrium \
             under inclined ground.",
        ),
        needed(
            "gravity_stage_damping",
            Kind::Number(SHARE),
            "Local damping of the gravity stage, as a share of the unbalanced force; not used with k0.",
        ),
        needed("gravity_stage_s", Kind::Number(POSITIVE), "Duration of the gravity stage; not used with k0."),
        needed("duration_s", Kind::Number(POSITIVE), "Longest simulated time of the failure stage."),
        needed("stop_at_rest", Kind::Flag, "Whether to stop once the material is at rest."),
        needed(
            "rest_kinetic_energy_share",
            Kind::Number(SHARE),
            "Rest, relative: kinetic energy below this share of its maximum.",
        ),
        needed(
            "rest_velocity_m_s",
            Kind::Number(NON_NEGATIVE),
            "Rest, absolute: root mean square of the points' net velocity over several windows of rest_hold_s below this.",
        ),
        needed("rest_hold_s", Kind::Number(NON_NEGATIVE), "How long a rule for rest must hold."),
        needed(
            "rest_pore_pressure_change_kpa",
            Kind::Number(POSITIVE),
            "Rest, two phases: at its present rate the pore pressure (root mean square over the points) would change by less \
             than this in the time left.",
        ),
        needed(
            "energy_drift_limit",
            Kind::Number(POSITIVE),
            "Share of the available energy by which the balance of energy may drift before a realisation is marked.",
        ),
    ],
};
