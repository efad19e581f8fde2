//! B14: the column of aluminium rods of Bui et al. (2008).

use super::Column;
use crate::validation::{Case, Check, Comparison, Depth, Figure, Findings, Marks, Series};

pub(in crate::validation) const RODS: Case = Case {
    name: "aluminium-rods",
    title: "Collapse of a column of aluminium rods (B14, information)",
    about: "The experiment of Bui, Fukagawa, Sako & Ohno (2008, Int. J. Numer. Anal. Meth. Geomech. 32:1537): a \
column of rods 200 mm wide and 100 mm high, E 0.84 MPa, nu 0.3, phi 19.8 degrees, no cohesion, no dilation, bulk \
density 1850 kg/m3 as open codes take it. Their final front is about 0.43 m and the intact top 0.05 to 0.08 m by \
recollection, not digitised from the paper, so this case cannot fail: it shows our front and profile at two \
resolutions, without damping and with a little PIC.",
    run,
};

/// Recollected, not checked against the paper's figure, m.
const FRONT_M: f64 = 0.43;

/// Simulated time: ten times sqrt(h0 / g), s.
const DURATION_S: f64 = 1.0;

const PIC_RATES_PER_S: [f64; 2] = [0.0, 10.0];

fn run(depth: Depth) -> Findings {
    let cells_m: &[f64] = match depth {
        Depth::Quick => &[0.010, 0.005],
        Depth::Full => &[0.005, 0.0025],
    };
    let mut findings = Findings::default();
    let mut series = Vec::new();
    for &cell_m in cells_m {
        for pic_rate_per_s in PIC_RATES_PER_S {
            let column = Column {
                width_m: 0.2,
                height_m: 0.1,
                friction_angle_deg: 19.8,
                density_kg_m3: 1850.0,
                youngs_modulus_pa: 0.84e6,
                poissons_ratio: 0.3,
                cell_m,
                pic_rate_per_s,
                room_widths: 5.0,
            };
            let label = format!("{} mm cells, PIC {pic_rate_per_s} 1/s", 1e3 * cell_m);
            let deposit = column.collapse(DURATION_S);
            let mut tell = |what: &str, reference: f64, found: Option<f64>| {
                findings.checks.push(Check {
                    what: format!("{what}, {label}"),
                    unit: "m",
                    reference,
                    found: found.unwrap_or(f64::NAN),
                    comparison: Comparison::Information,
                });
            };
            tell("contiguous front", FRONT_M, deposit.as_ref().map(|d| d.front_m));
            tell("front of 99 % of the material", FRONT_M, deposit.as_ref().map(|d| d.front_q99_m));
            tell("height at the wall", 0.1, deposit.as_ref().map(|d| d.height_m));
            if let Some(deposit) = deposit {
                series.push(Series { label, points: deposit.surface, marks: Marks::Line });
            }
        }
    }
    findings.figures.push(Figure {
        name: "profile".into(),
        title: "Ground surface after the collapse".into(),
        x: "distance from the wall, m".into(),
        y: "height, m".into(),
        equal_axes: true,
        series,
    });
    findings
}
