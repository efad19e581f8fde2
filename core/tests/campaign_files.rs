//! The shipped campaigns are valid, and faults in campaign files are refused with the key, the value and what is
//! allowed.

use runout_core::campaign::{self, CampaignError, MarginalChoice, StopRule};
use runout_core::site::Property;
use runout_core::slope;

const ELKHORN: &str = include_str!("../../campaigns/elkhorn-river/campaign.toml");
const SHIPPED: [(&str, &str); 5] = [
    ("elkhorn-river/campaign.toml", ELKHORN),
    ("elkhorn-river/paper.toml", include_str!("../../campaigns/elkhorn-river/paper.toml")),
    ("salt-creek/campaign.toml", include_str!("../../campaigns/salt-creek/campaign.toml")),
    ("salt-creek/paper.toml", include_str!("../../campaigns/salt-creek/paper.toml")),
    ("quick/campaign.toml", include_str!("../../campaigns/quick/campaign.toml")),
];

#[test]
fn every_shipped_campaign_is_valid() {
    for (name, text) in SHIPPED {
        if let Err(error) = campaign::parse(text) {
            panic!("{name}: {error}");
        }
    }
}

#[test]
fn units_become_si_in_one_place() {
    let campaign = campaign::parse(ELKHORN).unwrap();
    assert_eq!(campaign.random, [Property::Cohesion, Property::FrictionAngle]);
    assert_eq!(campaign.fit.marginals, [MarginalChoice::Auto, MarginalChoice::Auto]);
    assert_eq!(campaign.model.soil.youngs_modulus_pa, 100e6);
    assert_eq!(campaign.model.soil.unit_weight_n_m3, Some(20e3));
    assert_eq!(campaign.model.water.bulk_modulus_pa, 400e6);
    assert_eq!(slope::mean_angle_rad(&campaign.model.slope), std::f64::consts::FRAC_PI_4);
    assert!(matches!(campaign.stop.rule, StopRule::Interval { confidence: 0.95, .. }));
}

/// The message for the Elkhorn campaign with `from` replaced by `to`.
fn fault(from: &str, to: &str) -> String {
    assert!(ELKHORN.contains(from), "the fixture lacks `{from}`");
    campaign::parse(&ELKHORN.replacen(from, to, 1)).expect_err(to).to_string()
}

#[test]
fn values_out_of_range_name_key_value_and_range() {
    for (from, to, message) in [
        (
            "scale_of_fluctuation_vertical_m = 2.0",
            "scale_of_fluctuation_vertical_m = -2.0",
            "field.scale_of_fluctuation_vertical_m = -2 is not allowed; it must be greater than 0",
        ),
        (
            "poissons_ratio = 0.35",
            "poissons_ratio = 0.5",
            "soil.poissons_ratio = 0.5 is not allowed; it must be in [0, 0.5)",
        ),
        (
            "formulation = \"two-phase\"",
            "formulation = \"three-phase\"",
            "analysis.formulation = \"three-phase\" is not allowed; it must be \"one-phase\" or \"two-phase\"",
        ),
        (
            "unit_weight_kn_m3 = 20.0",
            "unit_weight_kn_m3 = 2.0",
            "soil.unit_weight_kn_m3 = 2 is not allowed; it must exceed the weight of the pore water, 2.943 kN/m3",
        ),
        (
            "unit_weight_kn_m3 = 20.0",
            "",
            "soil.unit_weight_kn_m3 = (absent) is not allowed; it is not a random property: give its value",
        ),
        (
            "porosity = 0.3",
            "porosity = 0.3\ncohesion_kpa = 5.0",
            "soil.cohesion_kpa = 5 is not allowed; it is a random property: leave it out here",
        ),
        ("porosity = 0.3", "porosity = nan", "soil.porosity = NaN is not allowed; it must be in (0, 1)"),
        (
            "maximum_realisations = 2000",
            "maximum_realisations = 20",
            "stop.maximum_realisations = 20 is not allowed; it must be 100 or more",
        ),
        (
            "confidence = 0.95",
            "confidence = 0.95\ntolerance = 0.1",
            "stop.tolerance = a value is not allowed; it belongs to rule \"paper\"",
        ),
        (
            "initial_pore_pressure = \"none\"",
            "initial_pore_pressure = \"hydrostatic\"",
            "water.water_table = (absent) is not allowed; \"hydrostatic\" needs \"ground-surface\", an elevation \
             in m, or a line [[x, y], ...]",
        ),
    ] {
        assert_eq!(fault(from, to), message);
    }
}

#[test]
fn unknown_keys_come_with_a_suggestion() {
    let error = campaign::parse(&ELKHORN.replacen("angle_deg = 45.0", "angel_deg = 45.0", 1)).unwrap_err();
    let CampaignError::Form { message, suggestion } = error else { panic!("{error}") };
    assert!(message.contains("unknown field `angel_deg`"), "{message}");
    assert!(message.contains("line"), "{message}");
    assert_eq!(suggestion.as_deref(), Some("angle_deg"));
}

#[test]
fn missing_keys_are_errors_because_physics_has_no_defaults() {
    assert!(fault("porosity = 0.3", "").contains("missing field `porosity`"));
}

#[test]
fn given_distributions_need_no_site() {
    let start = ELKHORN.find("[site]").unwrap();
    let end = ELKHORN.find("[fit]").unwrap();
    let text = format!("{}{}", &ELKHORN[..start], &ELKHORN[end..]);
    let given = "criterion = \"aic\"
        [fit.marginals.cohesion_kpa]
        family = \"trunc-normal\"
        mean = 11.4
        sd = 6.2
        [fit.marginals.friction_angle_deg]
        family = \"weibull\"
        p = 29.0
        q = 5.0
        [fit.copula]
        family = \"frank\"
        theta = -5.0\n";
    let campaign = campaign::parse(&text.replacen("criterion = \"aic\"\n", given, 1)).unwrap();
    assert_eq!(campaign.site, None);
    assert!(campaign::parse(&text).unwrap_err().to_string().contains("fit.marginals"));
}
