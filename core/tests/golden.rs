//! Golden digests: the bits of outcomes, guarded.
//!
//! If one of these changes, the same spec gives other bits: raise `SPEC_FORMAT`, say so in the changelog, and put the
//! new digest here in the same commit.

use runout_core::campaign;
use runout_core::fit::fit;
use runout_core::gimp::Kernel;
use runout_core::realisation::{Prepared, Progress, probe};
use runout_core::site;
use runout_core::spec::{SPEC_FORMAT, Spec};

/// Every kernel that runs here gives the probe's golden digest.
#[test]
fn the_probe_gives_its_golden_digest_on_every_kernel() {
    for kernel in Kernel::available() {
        assert_eq!(probe(kernel), "cf38e9ba5f295219617702ab1c84bcde", "{}", kernel.name());
    }
}

/// From the quick campaign's text and data to the digests of its spec and of its first realisation, shortened to 2 s, with
/// its profile along the ground or, as specs were before it could be asked for, without.
fn quick(profile: bool) -> (String, String) {
    let text = include_str!("../../campaigns/quick/campaign.toml");
    let mut campaign = campaign::parse(text).unwrap();
    campaign.model.analysis.duration_s = 2.0;
    assert!(campaign.model.sample.profile);
    campaign.model.sample.profile = profile;
    let settings = campaign.site.as_ref().unwrap();
    let data = site::parse(include_str!("../../campaigns/quick/site.csv"), &settings.columns, settings.zeros);
    let fit = fit(&campaign.random, Some(&data.unwrap()), &campaign.fit).unwrap();
    let spec = Spec {
        format: SPEC_FORMAT,
        seed: campaign.seed,
        random: fit.random(&campaign.random),
        copula: fit.copula.best.clone(),
        model: campaign.model,
    };
    let of_spec = spec.digest();
    let outcome = Prepared::new(spec, Kernel::best()).unwrap().realise(0, &Progress::default()).unwrap();
    assert_eq!(outcome.profile.is_some(), profile);
    (of_spec, outcome.digest)
}

#[test]
fn the_quick_campaign_gives_its_golden_digests() {
    let (spec, outcome) = quick(false);
    assert_eq!(spec, "cf4b51fa649ff0c3a98e890af89738cfcf837b0d08d34f74ae0519da4ea9ea0f");
    assert_eq!(outcome, "670730f31aa19396f3a12f17ecef7698");
}

#[test]
fn the_quick_campaign_with_profiles_gives_its_golden_digests() {
    let (spec, outcome) = quick(true);
    assert_eq!(spec, "ede65f88e21e99b41c85db91ef608b331278d19f58e196aab3c4650a9080057d");
    assert_eq!(outcome, "c9224d20091354123000e8c49b56da43");
}
