//! The fit of arbitrary tables: numbers or a reason, never a panic and never something that is not a number.

use proptest::prelude::*;
use runout_core::campaign::{CopulaChoice, Criterion, FitSettings, MarginalChoice, Recipe};
use runout_core::copula::Sampler;
use runout_core::fit::{Fit, fit, marginal_candidates};
use runout_core::site::{Property, SiteData};
use runout_core::special::SMALLEST_UNIFORM;

const RECIPES: [Recipe; 2] = [Recipe::Paper, Recipe::Likelihood];

/// Values as tables have them: rounded to tenths, with zeros and ties.
fn value() -> impl Strategy<Value = f64> {
    prop_oneof![1 => Just(0.0), 8 => (0_u32..600).prop_map(|tenths| f64::from(tenths) / 10.0)]
}

fn table() -> impl Strategy<Value = SiteData> {
    (1_usize..=3, 5_usize..40).prop_flat_map(|(properties, tests)| {
        prop::collection::vec(prop::collection::vec(value(), tests), properties)
            .prop_map(|values| SiteData { properties: Property::ALL[..values.len()].to_vec(), values })
    })
}

fn assert_usable(found: &Fit) {
    for property in found.marginals.values() {
        let (mean, sd) = property.best.moments();
        assert!(mean.is_finite() && sd.is_finite() && sd > 0.0, "{:?}", property.best);
        for u in [SMALLEST_UNIFORM, 0.5, 1.0 - SMALLEST_UNIFORM] {
            let x = property.best.quantile(u);
            assert!(x.is_finite() && x >= 0.0, "{:?} at {u}: {x}", property.best);
        }
    }
    assert!(Sampler::new(&found.copula.best).is_ok(), "{:?}", found.copula.best);
    for candidate in &found.copula.candidates {
        assert_eq!(candidate.aic.is_some(), candidate.copula().is_some(), "{candidate:?}");
        assert!(candidate.aic.is_some() || candidate.note.is_some());
        assert!(candidate.aic.is_none_or(f64::is_finite), "{candidate:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_table_is_fitted_or_refused(data in table()) {
        for recipe in RECIPES {
            let settings = FitSettings {
                recipe,
                criterion: Criterion::Bic,
                marginals: vec![MarginalChoice::Auto; data.properties.len()],
                copula: CopulaChoice::Auto,
            };
            match fit(&data.properties, Some(&data), &settings) {
                Ok(found) => assert_usable(&found),
                Err(why) => prop_assert!(!why.to_string().is_empty()),
            }
        }
    }

    /// Samples of any scale and spread, as runout distances are.
    #[test]
    fn any_sample_gives_numbers_or_a_reason(
        scale in -6.0..6.0_f64, shape in 0.1..20.0_f64, uniforms in prop::collection::vec(1e-6..1.0_f64, 3..60),
    ) {
        let scale = libm::exp(scale);
        let sample: Vec<f64> = uniforms.iter().map(|u| scale * libm::pow(-libm::log(*u), 1.0 / shape)).collect();
        for recipe in RECIPES {
            for candidate in marginal_candidates(&sample, recipe) {
                match candidate.marginal() {
                    Some(marginal) => {
                        prop_assert!(marginal.check().is_ok());
                        prop_assert!(candidate.aic.is_some_and(f64::is_finite), "{candidate:?}");
                        prop_assert!(candidate.mean.is_some_and(f64::is_finite), "{candidate:?}");
                        prop_assert!(candidate.sd.is_some_and(|sd| sd.is_finite() && sd > 0.0), "{candidate:?}");
                    }
                    None => prop_assert!(candidate.note.is_some()),
                }
            }
        }
    }
}
