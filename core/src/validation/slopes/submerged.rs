//! A slope under standing water against one phase of buoyant weight.

use super::{EXAMPLE_I, Slide, TWO_PHASE, ending, runout_m};
use crate::validation::set_up::{GRAVITY_M_S2, WATER_KG_M3};
use crate::validation::{Case, Check, Depth, Findings};

pub(in crate::validation) const SUBMERGED: Case = Case {
    name: "submerged-slope",
    title: "A submerged slope is a dry one of buoyant weight",
    about: "Under still water above its crest a slope feels gamma - gamma_w, once its excess pore pressures have drained. \
Two phases with free water 3 m above the crest against one phase of buoyant weight. Example I is stable then (factor of \
safety 1.125 by Bishop's method): under 0.05 m. With c reduced by gamma' / gamma it is the slide of the dry slope (0.845) \
again. The forces are equal and know no rate, so that the same path is run, more slowly by the square root of the mass \
ratio; the velocity filter's rate is scaled alike. Permeable soil (0.1 m/s: excess pressures drain over 40 m in a second). \
Tolerance: 10 per cent, less than halving the cell changes (slope-convergence). At the paper's 1e-4 m/s, where excess \
pressures drain over 1.3 m in a second, the answer need not be the same: information.",
    run,
};

const STAYS_M: f64 = 0.05;
const RUNOUT_TOLERANCE: f64 = 0.10;

const UNDER_WATER: &str = "initial_pore_pressure = \"submerged\"\nfree_water_level_m = 18.0";

fn run(depth: Depth) -> Findings {
    let cells: &[f64] = match depth {
        Depth::Quick => &[0.8],
        Depth::Full => &[0.8, 0.4],
    };
    let mut findings = Findings::default();
    for &cell_m in cells {
        compare(&mut findings, cell_m);
    }
    findings
}

fn compare(findings: &mut Findings, cell_m: f64) {
    let total = EXAMPLE_I.unit_weight_kn_m3;
    let buoyant = total - WATER_KG_M3 * GRAVITY_M_S2 / 1e3;
    let wet = Slide {
        cell_m,
        water: UNDER_WATER,
        permeability_m_s: 0.1,
        pic_rate_per_s: EXAMPLE_I.pic_rate_per_s,
        ..TWO_PHASE
    };
    let dry = Slide {
        cell_m,
        unit_weight_kn_m3: buoyant,
        pic_rate_per_s: EXAMPLE_I.pic_rate_per_s * libm::sqrt(total / buoyant),
        runout_plain_m: TWO_PHASE.runout_plain_m,
        ..EXAMPLE_I
    };
    for (name, slide) in [("two phases, submerged", wet), ("one phase, buoyant", dry)] {
        let outcome = slide.run();
        let what = format!("displacement at FS 1.125, {name}, {cell_m} m cells ({})", ending(&outcome));
        findings.checks.push(Check::at_most(what, "m", STAYS_M, runout_m(&outcome)));
    }
    let cohesion_kpa = EXAMPLE_I.cohesion_kpa * buoyant / total;
    let reference = Slide { cohesion_kpa, ..dry }.run();
    let drained = Slide { cohesion_kpa, ..wet }.run();
    let what = format!("displacement at FS 0.845, two phases against one, {cell_m} m cells");
    let (dry_m, wet_m) = (runout_m(&reference), runout_m(&drained));
    findings.checks.push(Check::relative(what, "m", dry_m, wet_m, RUNOUT_TOLERANCE));
    let paper = Slide { cohesion_kpa, permeability_m_s: EXAMPLE_I.permeability_m_s, ..wet }.run();
    let what = format!("displacement at FS 0.845, k 1e-4 m/s, {cell_m} m cells ({})", ending(&paper));
    findings.checks.push(Check::information(what, "m", dry_m, runout_m(&paper)));
}
