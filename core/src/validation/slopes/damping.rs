//! What damping does to the answer, and that its effect does not hang on the time step.

use super::{EXAMPLE_I, Slide, check, runout_m};
use crate::validation::{Case, Comparison, Depth, Figure, Findings, Marks, Series};

pub(in crate::validation) const DAMPING: Case = Case {
    name: "damping",
    title: "Damping is a rate: its effect does not hang on the time step",
    about: "Damping shortens the runout by tens of per cent, so it is an input, and its effect must not depend on the \
time step. The slide of the reference paper's Example I (one phase, 0.8 m cells) with PIC, with local damping (a share \
of the unbalanced force) and with a rate at which all velocities decay, each at Courant numbers 0.8 and 0.2. Gate: \
2 per cent, the effect of the time step without damping (see slope-convergence); and each setting must shorten the runout, \
or it does nothing.",
    run,
};

const TIME_STEP_TOLERANCE: f64 = 0.02;

/// Least shortening of the runout that shows that a setting acts.
const ACTS: f64 = 0.01;

fn run(depth: Depth) -> Findings {
    let undamped = Slide { pic_rate_per_s: 0.0, cell_m: 0.8, ..EXAMPLE_I };
    let pic = |rate: f64| (rate, Slide { pic_rate_per_s: rate, ..undamped });
    let local = |share: f64| (share, Slide { local_damping: share, ..undamped });
    let decay = |rate: f64| (rate, Slide { damping_rate_per_s: rate, ..undamped });
    let kinds: [(&str, Vec<(f64, Slide)>); 3] = match depth {
        Depth::Quick => [
            ("PIC rate, 1/s", vec![pic(4.4)]),
            ("local damping", vec![local(0.02)]),
            ("decay of all velocities, 1/s", vec![decay(0.5)]),
        ],
        Depth::Full => [
            ("PIC rate, 1/s", [2.2, 4.4, 8.8, 17.6].map(pic).to_vec()),
            ("local damping", [0.01, 0.02, 0.05, 0.1].map(local).to_vec()),
            ("decay of all velocities, 1/s", [0.1, 0.2, 0.5, 1.0].map(decay).to_vec()),
        ],
    };
    let mut findings = Findings::default();
    let free = runout_m(&undamped.run());
    findings.checks.push(check("displacement without damping", "m", 0.0, free, Comparison::Information));
    for (kind, slides) in kinds {
        let mut points = vec![[0.0, free]];
        for (value, slide) in slides {
            let coarse = runout_m(&slide.run());
            let fine = runout_m(&Slide { courant: 0.2, ..slide }.run());
            findings.checks.push(check(
                format!("displacement, {kind} {value}, Courant number 0.2 against 0.8"),
                "m",
                coarse,
                fine,
                Comparison::Relative(TIME_STEP_TOLERANCE),
            ));
            findings.checks.push(check(
                format!("runout lost, {kind} {value}"),
                "",
                ACTS,
                1.0 - coarse / free,
                Comparison::AtLeast,
            ));
            points.push([value, coarse]);
        }
        findings.figures.push(figure(kind, points));
    }
    findings
}

fn figure(kind: &str, points: Vec<[f64; 2]>) -> Figure {
    let name = kind.split([' ', ',']).next().unwrap_or(kind).to_lowercase();
    Figure {
        title: format!("Displacement against {kind}"),
        name,
        x: kind.into(),
        y: "99.9 % quantile of displacement, m".into(),
        equal_axes: false,
        series: vec![Series { label: "Courant number 0.8".into(), points, marks: Marks::Circles }],
    }
}
