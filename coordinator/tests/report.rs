//! The report is made from any number of outcomes, and of few it says what cannot be given.

use runout::load::{self, Loaded};
use runout::report::{self, Material, Report};
use runout_core::gimp::Energy;
use runout_core::marginal::{Family, Marginal};
use runout_core::outcome::{Measures, Outcome, OutcomeKind, Reason};
use std::path::Path;

fn loaded() -> Loaded {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../campaigns/elkhorn-river/campaign.toml");
    load::load(&path).expect("the example is sound")
}

/// Every fifth realisation is stable, every fiftieth failed; the others' runout are quantiles of the paper's Weibull
/// distribution with scale 6 m and shape 2.3.
fn outcomes(count: u64) -> Vec<Outcome> {
    let weibull = Marginal { family: Family::Weibull, p: 6.0, q: 2.3 };
    // Multiples of the golden ratio fill the unit interval evenly.
    let share = |index: u64| ((index as f64 + 0.5) * 0.618_033_988_749_895).fract();
    let of = |index: u64| {
        let kind = match index {
            i if i % 50 == 7 => OutcomeKind::Failed,
            i if i % 5 == 3 => OutcomeKind::Stable,
            _ => OutcomeKind::Runout,
        };
        let runout_m = if kind == OutcomeKind::Stable { 0.01 } else { 0.1 + weibull.quantile(share(index)) };
        let measures = Measures {
            max_displacement_m: runout_m,
            displacement_q999_m: runout_m,
            toe_advance_m: runout_m,
            crest_retreat_m: 0.0,
            moved_area_m2: 0.0,
            deposit_height_at_toe_m: 0.0,
            time_to_rest_s: None,
        };
        Outcome {
            index,
            outcome: kind,
            reason: if kind == OutcomeKind::Failed { Reason::LeftGrid } else { Reason::AtRest },
            measures: (kind != OutcomeKind::Failed).then_some(measures),
            energy: (kind != OutcomeKind::Failed).then(Energy::default),
            energy_drifted: false,
            simulated_s: 5.0,
            steps: 1,
            points: 1,
            digest: String::new(),
        }
    };
    (0..count).map(of).collect()
}

fn of(loaded: &Loaded, outcomes: &[Outcome], notes: &[String]) -> Report {
    report::report(&Material {
        campaign: &loaded.campaign,
        campaign_text: &loaded.campaign_text,
        site: loaded.site.as_ref(),
        fit: &loaded.fit,
        spec: &loaded.spec,
        outcomes,
        notes,
    })
    .expect("it can be drawn")
}

#[test]
fn few_outcomes_are_no_panic_and_what_is_missing_is_said() {
    let loaded = loaded();
    let page = |count: u64| of(&loaded, &outcomes(count), &[]).html;
    assert!(page(0).contains("none yet: no realisation has been decided"));
    assert!(page(1).contains("With 1 samples there is no exceedance curve"));
    assert!(page(2).contains("No family is fitted: there are 2 samples"));
    for count in 3..12 {
        assert!(page(count).ends_with("</body></html>\n"));
    }
}

#[test]
fn a_slope_that_never_failed_is_reported_as_that() {
    let loaded = loaded();
    let stable: Vec<Outcome> =
        outcomes(100).into_iter().filter(|o| o.outcome == OutcomeKind::Stable).collect();
    let stable: Vec<Outcome> = (0..).zip(stable).map(|(index, o)| Outcome { index, ..o }).collect();
    assert!(of(&loaded, &stable, &[]).html.contains("in none of 20 realisations did the slope fail"));
}

#[test]
fn equal_samples_have_no_spread_and_no_family() {
    let loaded = loaded();
    let mut equal = outcomes(20);
    for outcome in &mut equal {
        outcome.outcome = OutcomeKind::Runout;
        let one = Measures {
            max_displacement_m: 2.0,
            displacement_q999_m: 2.0,
            toe_advance_m: 2.0,
            crest_retreat_m: 0.0,
            moved_area_m2: 0.0,
            deposit_height_at_toe_m: 0.0,
            time_to_rest_s: None,
        };
        outcome.measures = Some(one);
    }
    assert!(of(&loaded, &equal, &[]).html.contains("No family is fitted"));
}

#[test]
fn a_full_report_is_self_contained_and_the_same_every_time() {
    let loaded = loaded();
    let outcomes = outcomes(300);
    let notes = ["realisation 9 gave <another> digest".to_owned()];
    let report = of(&loaded, &outcomes, &notes);
    let names: Vec<&str> = report.figures.iter().map(|f| f.name).collect();
    let expected = [
        "section",
        "histogram-likelihood",
        "histogram-moments",
        "exceedance",
        "exceedance-log",
        "convergence-mean",
        "convergence-variance",
    ];
    assert_eq!(names, expected);
    for word in
        [&loaded.spec.digest(), "weibull", "soil.permeability_m_s", "gave &lt;another&gt; digest", "0.1 %"]
    {
        assert!(report.html.contains(word), "{word} is missing");
    }
    // Nothing is fetched: the only address is the name of SVG's vocabulary.
    let addresses = report.html.matches("http").count();
    assert_eq!(addresses, report.html.matches("http://www.w3.org/2000/svg").count());
    assert_eq!(of(&loaded, &outcomes, &notes).html, report.html);
}
