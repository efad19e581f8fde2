//! Depths and speeds along the ground in front of the toe: quantiles given failure, with intervals that rest on no
//! distribution, and how probable deposits of some depths are.

use super::reach::{Probability, Reach};
use runout_core::estimate::exceedance::interval_places;
use runout_core::estimate::interval::Interval;
use runout_core::outcome::Outcome;
use runout_core::profile::{Profile, Stations};

/// Depths of deposits whose probability is given, m: round numbers of the order that matters to people and to
/// light buildings.
pub const DEPTHS_M: [f64; 2] = [0.5, 1.0];

/// A quantile, a number a column.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Quantile {
    /// The values.
    pub values: Vec<f64>,
    /// Their intervals; absent with too few profiles.
    pub intervals: Option<Vec<Interval>>,
}

/// Quantiles of one quantity.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Quantiles {
    /// Median.
    pub median: Quantile,
    /// Exceeded in one of ten.
    pub one_in_ten: Quantile,
    /// The largest, a number a column.
    pub largest: Vec<f64>,
}

/// Where the profiles are from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Evidence {
    /// Every sample's outcome holds its own.
    Recorded,
    /// Some samples were replayed for them.
    Replayed,
}

/// The probability that a deposit is deeper than some depth.
#[derive(Debug, Clone, PartialEq)]
pub struct Deeper {
    /// The depth, m.
    pub depth_m: f64,
    /// Over all realisations, stable ones included; a column each.
    pub probabilities: Vec<Probability>,
}

/// The profiles together.
#[derive(Debug, Clone, PartialEq)]
pub struct Hazard {
    /// Middles of the columns, m from the toe.
    pub x_m: Vec<f64>,
    /// Width of a column, m.
    pub column_m: f64,
    /// Profiles.
    pub profiles: usize,
    /// Where they are from.
    pub evidence: Evidence,
    /// Depth of the soil above the original ground, m.
    pub depth_m: Quantiles,
    /// Highest speed, m/s.
    pub speed_m_s: Quantiles,
    /// For [`DEPTHS_M`]; empty unless every sample has a profile.
    pub deeper: Vec<Deeper>,
}

/// The profiles of all samples (given by their indices) of `outcomes`, which stand in index order from 0; none if one has
/// no profile.
pub fn recorded<'a>(outcomes: &'a [Outcome], samples: &[u64]) -> Option<Vec<&'a Profile>> {
    samples.iter().map(|index| outcomes.get(usize::try_from(*index).ok()?)?.profile.as_ref()).collect()
}

/// Puts profiles together; none without any. `reach` knows how many realisations there are besides.
pub fn hazard(
    stations: &Stations,
    profiles: &[&Profile],
    evidence: Evidence,
    reach: &Reach,
    confidence: f64,
) -> Option<Hazard> {
    let n = profiles.len();
    let places = [0.5, 0.9].map(|p| interval_places(n, p, confidence));
    let all = |of: fn(&Profile, usize) -> f64| quantiles(stations.count, profiles, of, places);
    let depths_m = if evidence == Evidence::Recorded { &DEPTHS_M[..] } else { &[] };
    (n > 0).then(|| Hazard {
        x_m: (0..stations.count).map(|column| stations.x_m(column)).collect(),
        column_m: stations.width_m,
        profiles: n,
        evidence,
        depth_m: all(Profile::depth_m),
        speed_m_s: all(Profile::speed_m_s),
        deeper: depths_m.iter().map(|depth_m| deeper(stations, profiles, reach, *depth_m)).collect(),
    })
}

/// A stable slope deposits nothing, as it reaches nothing.
fn deeper(stations: &Stations, profiles: &[&Profile], reach: &Reach, depth_m: f64) -> Deeper {
    let hits = |column| profiles.iter().filter(|profile| profile.depth_m(column) > depth_m).count() as u64;
    let probabilities = (0..stations.count).filter_map(|column| reach.probability(hits(column))).collect();
    Deeper { depth_m, probabilities }
}

/// Places of the ends of the intervals of median and one in ten, see [`interval_places`].
type Places = [Option<(usize, usize)>; 2];

fn quantiles(
    columns: usize,
    profiles: &[&Profile],
    of: fn(&Profile, usize) -> f64,
    [of_median, of_ninety]: Places,
) -> Quantiles {
    let start = |places: Option<_>| Quantile { intervals: places.map(|_| Vec::new()), ..Quantile::default() };
    let mut found = Quantiles { median: start(of_median), one_in_ten: start(of_ninety), largest: Vec::new() };
    for column in 0..columns {
        let mut sorted: Vec<f64> = profiles.iter().map(|profile| of(profile, column)).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        found.median.push(&sorted, 0.5, of_median);
        found.one_in_ten.push(&sorted, 0.9, of_ninety);
        found.largest.push(sorted[sorted.len() - 1]);
    }
    found
}

impl Quantile {
    /// Takes the next column: the smallest of its sorted values that at most a share 1 - p of them exceeds.
    fn push(&mut self, sorted: &[f64], p: f64, places: Option<(usize, usize)>) {
        self.values.push(sorted[((p * sorted.len() as f64).ceil() as usize).clamp(1, sorted.len()) - 1]);
        if let (Some(intervals), Some((low, high))) = (&mut self.intervals, places) {
            intervals.push([sorted[low], sorted[high]]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::reach;
    use crate::store::tests::record;
    use runout_core::campaign::{Contact, Mesh, Slope, Surface};
    use runout_core::outcome::OutcomeKind;

    fn profile(depth_mm: u32) -> Profile {
        Profile { column_m: 2.0, depth_mm: vec![depth_mm], speed_mm_s: vec![2 * depth_mm, 1000] }
    }

    /// Two columns of 2 m.
    fn stations() -> Stations {
        let surface = Surface::Uniform { height_m: 4.0, angle_rad: 0.8, crest_width_m: 4.0 };
        let slope = Slope { surface, foundation_depth_m: 2.0, runout_plain_m: 4.0, base: Contact::Fixed };
        Stations::of(&slope, &Mesh { cell_size_m: 2.0, points_per_cell_side: 2 })
    }

    /// Ten samples with deposits of 0.1 to 1 m, and ten stable slopes: five samples of 20 are deeper than half a metre.
    #[test]
    fn quantiles_and_probabilities_are_those_of_each_column() {
        let mut outcomes: Vec<Outcome> = (0..20).map(|index| record(index).outcome).collect();
        for outcome in &mut outcomes {
            if outcome.index < 10 {
                outcome.profile = Some(profile(100 * (outcome.index as u32 + 1)));
            } else {
                outcome.outcome = OutcomeKind::Stable;
            }
            outcome.measures.as_mut().unwrap().toe_advance_m = 3.0;
        }
        let samples: Vec<u64> = (0..10).collect();
        let profiles = recorded(&outcomes, &samples).expect("every sample has one");
        let reach = reach::reach(&outcomes, 0.95);
        let of = |evidence| hazard(&stations(), &profiles, evidence, &reach, 0.95).expect("there are some");
        let found = of(Evidence::Recorded);
        assert_eq!((found.x_m.as_slice(), found.column_m), (&[1.0, 3.0][..], 2.0));
        let Quantiles { median, one_in_ten, largest } = &found.depth_m;
        assert_eq!((&median.values[..], &one_in_ten.values[..]), (&[0.5, 0.0][..], &[0.9, 0.0][..]));
        assert_eq!((&largest[..], &found.speed_m_s.median.values[..]), (&[1.0, 0.0][..], &[1.0, 1.0][..]));
        assert_eq!(median.intervals, Some(vec![[0.2, 0.9], [0.0, 0.0]]));
        assert_eq!(one_in_ten.intervals, None);
        let half = &found.deeper[0];
        assert_eq!((half.depth_m, half.probabilities[0].hits, half.probabilities[0].share), (0.5, 5, 0.25));
        assert_eq!(half.probabilities[1].hits, 0);
        assert!(found.deeper[1].probabilities.iter().all(|p| p.hits == 0));
        assert!(of(Evidence::Replayed).deeper.is_empty());

        outcomes[3].profile = None;
        assert_eq!(recorded(&outcomes, &samples), None);
        assert_eq!(hazard(&stations(), &[], Evidence::Recorded, &reach, 0.95), None);
    }
}
