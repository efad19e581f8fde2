//! What an outcome of a campaign must look like, whoever computed it.
//!
//! Decoding has checked every number by itself (`runout_proto::convert`); what follows from the campaign is checked here.

use runout_core::campaign::Model;
use runout_core::outcome::{Outcome, OutcomeKind};
use runout_core::profile::Stations;

/// Checks that `outcome` has a profile along the ground exactly if the campaign records one and the analysis did not fail,
/// and that it stands on the campaign's columns.
///
/// # Errors
/// What does not fit, in words.
pub fn check(model: &Model, outcome: &Outcome) -> Result<(), String> {
    let wanted = model.sample.profile && outcome.outcome != OutcomeKind::Failed;
    let Some(profile) = &outcome.profile else {
        return if wanted {
            Err("outcome.profile = absent: the campaign records one".to_owned())
        } else {
            Ok(())
        };
    };
    if !wanted {
        return Err("outcome.profile = present: the campaign records none".to_owned());
    }
    let stations = Stations::of(&model.slope, &model.mesh);
    if profile.column_m != stations.width_m {
        let (found, wide) = (profile.column_m, stations.width_m);
        return Err(format!("profile.column_m = {found}: the campaign's columns are {wide} m wide"));
    }
    let columns = profile.depth_mm.len().max(profile.speed_mm_s.len());
    if columns > stations.count {
        return Err(format!("profile = {columns} columns: the campaign's plain has {}", stations.count));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load;
    use runout_core::gimp::Kernel;
    use runout_core::profile::Profile;
    use runout_core::realisation::{Prepared, Progress};
    use std::path::Path;

    /// An outcome as the solver gives it fits; the same with a profile that is not the campaign's does not.
    #[test]
    fn a_profile_is_there_as_the_campaign_asks_and_on_its_columns() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/inputs/good/given.toml");
        let mut spec = load::load(&path).unwrap().spec;
        spec.model.analysis.duration_s = 0.05;
        let mut model = spec.model.clone();
        assert!(model.sample.profile);
        let prepared = Prepared::new(spec, Kernel::best()).unwrap();
        let outcome = prepared.realise(0, &Progress::default()).unwrap();
        assert_eq!(check(&model, &outcome), Ok(()));

        let with = |profile: Option<Profile>| Outcome { profile, ..outcome.clone() };
        let profile = outcome.profile.clone().unwrap();
        let refused = |outcome: &Outcome| check(&model, outcome).unwrap_err();
        assert!(refused(&with(None)).starts_with("outcome.profile = absent"));
        let wider = Profile { column_m: 2.0 * profile.column_m, ..profile.clone() };
        assert!(refused(&with(Some(wider))).starts_with("profile.column_m = "));
        let longer = Profile { depth_mm: vec![1; 10_000], ..profile };
        assert!(refused(&with(Some(longer))).starts_with("profile = 10000 columns"));
        let failed = Outcome { outcome: OutcomeKind::Failed, ..outcome.clone() };
        assert!(refused(&failed).starts_with("outcome.profile = present"));
        model.sample.profile = false;
        assert!(check(&model, &outcome).unwrap_err().starts_with("outcome.profile = present"));
        assert_eq!(check(&model, &with(None)), Ok(()));
    }
}
