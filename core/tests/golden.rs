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
        assert_eq!(probe(kernel), "569167cd7f3ff1072af78d8d4e051c6a", "{}", kernel.name());
    }
}

/// From the quick campaign's text and data to the digests of its spec and of its first realisation, shortened to 2 s.
#[test]
fn the_quick_campaign_gives_its_golden_digests() {
    let text = include_str!("../../campaigns/quick/campaign.toml");
    let mut campaign = campaign::parse(text).unwrap();
    campaign.model.analysis.duration_s = 2.0;
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
    assert_eq!(spec.digest(), "9a86f9f98c919db9ac5dde9d14643c4c274f65b1b9284b4b93acae392784b0c7");
    let outcome = Prepared::new(spec, Kernel::best()).unwrap().realise(0, &Progress::default()).unwrap();
    assert_eq!(outcome.digest, "7bb1c046f3f5e8d2181cd8d26cf492c5");
}
