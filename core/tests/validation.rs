//! Every case of the validation suite, in its quick form; the full forms with `--ignored`.

use runout_core::validation::{Case, Check, Depth, cases};

fn describe(check: &Check) -> String {
    let error = check.error().map_or_else(String::new, |e| format!("error {e:.3e}, "));
    format!(
        "{} {}: found {:.6e}, reference {:.6e} {}({error}{:?})",
        if check.passes() { "pass" } else { "FAIL" },
        check.what,
        check.found,
        check.reference,
        check.unit,
        check.comparison
    )
}

fn case(name: &str) -> Case {
    cases().into_iter().find(|c| c.name == name).unwrap_or_else(|| panic!("there is no case {name}"))
}

/// Runs a case and names every check that fails.
fn holds(name: &str, depth: Depth) {
    let findings = (case(name).run)(depth);
    assert!(!findings.checks.is_empty(), "{name} checks nothing");
    for check in &findings.checks {
        println!("{}", describe(check));
    }
    for note in &findings.notes {
        println!("note: {note}");
    }
    let failing: Vec<String> = findings.checks.iter().filter(|c| !c.passes()).map(describe).collect();
    assert!(findings.passes() && failing.is_empty(), "{name}:\n{}", failing.join("\n"));
}

macro_rules! cases {
    ($($test:ident $name:literal)*) => {
        /// Names of the cases that have tests, in the suite's order.
        const TESTED: &[&str] = &[$($name),*];

        mod quick {
            use super::*;
            $(#[test] fn $test() { holds($name, Depth::Quick); })*
        }

        mod full {
            use super::*;
            $(#[test] #[ignore = "minutes: run with --ignored"] fn $test() { holds($name, Depth::Full); })*
        }
    };
}

cases! {
    gravity_column "gravity-column"
    large_compaction "large-compaction"
    axial_bar "axial-bar"
    velocity_filters "velocity-filters"
    grid_crossing "grid-crossing"
    manufactured "manufactured"
    two_disks "two-disks"
    block_on_incline "block-on-incline"
    drained_compression "drained-compression"
    hydrostatic_column "hydrostatic-column"
    consolidation "consolidation"
    self_weight_consolidation "self-weight-consolidation"
    both_ends_drained "both-ends-drained"
    undrained_wave "undrained-wave"
    undrained_compression "undrained-compression"
    slope_onset "slope-onset"
    slope_convergence "slope-convergence"
    water_modulus "water-modulus"
    submerged_slope "submerged-slope"
    damping "damping"
    dry_columns "dry-columns"
    aluminium_rods "aluminium-rods"
    invariance "invariance"
}

#[test]
fn every_case_has_a_test() {
    let names: Vec<&str> = cases().iter().map(|c| c.name).collect();
    assert_eq!(names, TESTED);
}
