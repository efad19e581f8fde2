//! x
use runout::report::{self, Material};
use runout_core::{campaign::*, copula::*, fit::*, marginal, marginal::*, outcome::*, spec::*};
use std::collections::BTreeMap;
fn main() {
    let n: u64 = std::env::args().nth(1).unwrap().parse().unwrap();
    let path = std::path::Path::new("campaigns/elkhorn-river/campaign.toml");
    let inputs = runout::load::read(path).unwrap();
    let m = Marginal { family: marginal::Family::TruncNormal, p: 11.0, q: 6.0 };
    let mf = || MarginalFit {
        best: m,
        chosen_by: "criterion",
        sample_mean: Some(11.412),
        sample_sd: Some(6.19148071),
        candidates: vec![
            MarginalCandidate {
                family: marginal::Family::TruncNormal,
                p: Some(11.0),
                q: Some(6.0),
                mean: Some(11.9),
                sd: Some(5.7),
                log_likelihood: Some(-79.7),
                aic: Some(163.445816),
                bic: Some(165.9),
                note: None,
            },
            MarginalCandidate {
                family: marginal::Family::Lognormal,
                p: None,
                q: None,
                mean: None,
                sd: None,
                log_likelihood: None,
                aic: None,
                bic: None,
                note: Some("cannot hold a value of exactly zero".into()),
            },
        ],
    };
    let mut marginals = BTreeMap::new();
    marginals.insert("cohesion_kpa", mf());
    marginals.insert("friction_angle_deg", mf());
    let fit = Fit {
        recipe: Recipe::Likelihood,
        criterion: Criterion::Aic,
        tests: Some(25),
        marginals,
        dependence: None,
        copula: CopulaFit { best: Copula::No16 { theta: 0.02 }, chosen_by: "criterion", candidates: vec![] },
    };
    let spec = Spec {
        format: 1,
        seed: 1,
        random: fit.random(&inputs.campaign.random),
        copula: fit.copula.best.clone(),
        model: inputs.campaign.model.clone(),
    };
    let w = Marginal { family: marginal::Family::Weibull, p: 6.0, q: 2.3 };
    let mut k = 1u64;
    let mut u = || {
        k = k.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((k >> 33) as f64 + 0.5) / 2f64.powi(31)
    };
    let outcomes: Vec<Outcome> = (0..n)
        .map(|index| {
            let d = w.quantile(u());
            let s = u();
            let (o, reason) = if s < 0.2 {
                (OutcomeKind::Stable, Reason::AtRest)
            } else if s < 0.22 {
                (OutcomeKind::Failed, Reason::LeftGrid)
            } else if s < 0.26 {
                (OutcomeKind::Runout, Reason::StillMoving)
            } else {
                (OutcomeKind::Runout, Reason::AtRest)
            };
            let d = if o == OutcomeKind::Stable { 0.02 } else { d + 0.1 };
            Outcome {
                index,
                outcome: o,
                reason,
                measures: (o != OutcomeKind::Failed).then_some(Measures {
                    max_displacement_m: d,
                    displacement_q999_m: d,
                    toe_advance_m: d,
                    crest_retreat_m: d,
                    moved_area_m2: d,
                    deposit_height_at_toe_m: d,
                    time_to_rest_s: None,
                }),
                simulated_s: 5.0,
                steps: 100,
                points: 10125,
                digest: "x".into(),
            }
        })
        .collect();
    let t = std::time::Instant::now();
    let r = report::report(&Material {
        campaign: &inputs.campaign,
        campaign_text: &inputs.campaign_text,
        site: inputs.site.as_ref(),
        fit: &fit,
        spec: &spec,
        outcomes: &outcomes,
        notes: &[],
    })
    .unwrap();
    eprintln!("{:?} {} bytes", t.elapsed(), r.html.len());
    std::fs::write("/tmp/report.html", r.html).unwrap();
}
