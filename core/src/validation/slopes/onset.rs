//! B12: at which strength does a slope fail?

use super::{EXAMPLE_I, Slide, check, ending, log_spiral, runout_m};
use crate::validation::{Case, Comparison, Depth, Figure, Findings, Marks, Series};

pub(in crate::validation) const ONSET: Case = Case {
    name: "slope-onset",
    title: "Onset of failure against limit analysis (B12)",
    about: "A homogeneous slope of 15 m (20 kN/m3, no pore pressure, no dilation, rigid base at toe level), with c and \
tan phi of limit equilibrium times a factor of safety FS. Limit equilibrium is the kinematic bound of a logarithmic \
spiral through the toe (Chen 1975), computed here. Gates: at FS 0.90 the 99.9 % quantile of displacement is over 1 m, \
at FS 1.10 under 0.05 m; ten per cent is the room for mesh, inertia and the non-associated flow rule. Without dilation \
a thin band mobilises sin phi, not tan phi (Davis 1968), so that stability is guaranteed for FS cos phi > 1 only: from \
25 degrees on FS 1.10 is no longer enough by that measure, and at 30 degrees it is information and FS 1.20 the gate. \
FS 0.95 and 1.05 separate nothing and are information.",
    run,
};

/// Displacement that a slope short of equilibrium must exceed, m, and one with a reserve must stay below, m.
const RUNS_M: f64 = 1.0;
const STAYS_M: f64 = 0.05;

/// Slope angle and friction angle at limit equilibrium, degrees.
const FAMILIES: [(f64, f64); 6] =
    [(45.0, 0.0), (45.0, 10.0), (45.0, 20.0), (45.0, 25.0), (45.0, 30.0), (60.0, 20.0)];
const QUICK_FAMILIES: [(f64, f64); 2] = [(45.0, 10.0), (45.0, 20.0)];
const FACTORS: [f64; 4] = [0.90, 0.95, 1.05, 1.10];
const QUICK_FACTORS: [f64; 2] = [0.90, 1.10];

/// From this friction angle on (degrees) a larger reserve is the gate.
const STEEP_FRICTION_DEG: f64 = 30.0;
const LARGE_RESERVE: f64 = 1.20;

fn run(depth: Depth) -> Findings {
    let (families, factors, cell_m): (&[_], &[_], f64) = match depth {
        Depth::Quick => (&QUICK_FAMILIES, &QUICK_FACTORS, 0.8),
        Depth::Full => (&FAMILIES, &FACTORS, 0.4),
    };
    let mut findings = Findings::default();
    let mut series = Vec::new();
    for &(angle_deg, friction_deg) in families {
        let mut points = Vec::new();
        let reserve = (friction_deg >= STEEP_FRICTION_DEG).then_some(LARGE_RESERVE);
        for factor in factors.iter().copied().chain(reserve) {
            let member = member(angle_deg, friction_deg, factor, cell_m);
            let outcome = member.run();
            let found = runout_m(&outcome);
            let (reference, comparison) = gate(friction_deg, factor);
            let what = format!(
                "displacement at {angle_deg} degrees, phi {friction_deg}, FS {factor:.2} ({cell_m} m cells, {})",
                ending(&outcome)
            );
            findings.checks.push(check(what, "m", reference, found, comparison));
            points.push([factor, found]);
        }
        series.push(Series {
            label: format!("{angle_deg} degrees, phi {friction_deg}"),
            points,
            marks: Marks::Circles,
        });
    }
    findings.figures.push(Figure {
        name: "onset".into(),
        title: "Displacement against factor of safety".into(),
        x: "factor of safety by limit analysis".into(),
        y: "99.9 % quantile of displacement, m".into(),
        equal_axes: false,
        series,
    });
    findings
}

/// The slope whose c and tan phi are `factor` times those of limit equilibrium.
fn member(angle_deg: f64, friction_deg: f64, factor: f64, cell_m: f64) -> Slide {
    let friction = friction_deg.to_radians();
    let number = log_spiral::stability_number(angle_deg.to_radians(), friction);
    let at_equilibrium = EXAMPLE_I.unit_weight_kn_m3 * EXAMPLE_I.height_m / number;
    Slide {
        angle_deg,
        cohesion_kpa: factor * at_equilibrium,
        friction_angle_deg: libm::atan(factor * libm::tan(friction)).to_degrees(),
        cell_m,
        ..EXAMPLE_I
    }
}

/// Reference and comparison of a family's member; FS 0.95 and 1.05 have none.
fn gate(friction_deg: f64, factor: f64) -> (f64, Comparison) {
    let reserve = if friction_deg >= STEEP_FRICTION_DEG { LARGE_RESERVE } else { 1.10 };
    match factor {
        f if f <= 0.90 => (RUNS_M, Comparison::AtLeast),
        f if f >= reserve => (STAYS_M, Comparison::AtMost),
        _ => (0.0, Comparison::Information),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The published pairs (physics.json, `fs_family_H15_beta45_gamma20`; three decimals).
    #[test]
    fn the_families_are_those_of_the_reference() {
        for (friction, factor, cohesion, angle) in [
            (10.0, 0.90, 29.002, 9.017),
            (10.0, 1.10, 35.447, 10.977),
            (20.0, 0.90, 16.707, 18.137),
            (20.0, 1.10, 20.420, 21.820),
        ] {
            let slide = member(45.0, friction, factor, 0.8);
            assert!((slide.cohesion_kpa / cohesion - 1.0).abs() < 1e-4, "{slide:?}");
            assert!((slide.friction_angle_deg - angle).abs() < 1e-3, "{slide:?}");
        }
    }
}
