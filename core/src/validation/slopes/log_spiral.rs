//! Stability number of a homogeneous slope by limit analysis: the kinematic bound of a rigid body that turns on a
//! logarithmic spiral through the toe (Chen 1975, "Limit analysis and soil plasticity", chapter 9, horizontal crest).

/// Steps of the first search of each angle of the spiral, and how often the search is refined by [`ZOOM`].
const STEPS: usize = 60;
const ROUNDS: usize = 12;
const ZOOM: f64 = 0.25;

/// Least height over first radius of a spiral that is looked at: in flatter ones the weight is a difference of nearly
/// equal numbers, and round-off makes bounds of zero.
const FLATTEST: f64 = 0.02;

/// gamma H / c at failure of a slope at `angle_rad` with friction angle `friction_rad`, both rad; the least upper
/// bound over spirals through the toe.
pub(super) fn stability_number(angle_rad: f64, friction_rad: f64) -> f64 {
    let right = std::f64::consts::PI;
    let (mut start, mut end, mut half) = (0.25 * right, 0.5 * right, 0.5 * right);
    let mut least = f64::INFINITY;
    for _ in 0..ROUNDS {
        let (centre_start, centre_end) = (start, end);
        for i in 0..=STEPS {
            for j in 0..=STEPS {
                let at = |centre: f64, k: usize| centre + half * (2.0 * k as f64 / STEPS as f64 - 1.0);
                let (from, to) = (at(centre_start, i), at(centre_end, j));
                let bound = bound(angle_rad, friction_rad, from, to);
                if bound < least {
                    (least, start, end) = (bound, from, to);
                }
            }
        }
        half *= ZOOM;
    }
    least
}

/// The bound of the spiral between the angles `from` (at the crest) and `to` (at the toe); infinite if there is none.
fn bound(angle: f64, friction: f64, from: f64, to: f64) -> f64 {
    let (sin, cos, tan) = (libm::sin, libm::cos, libm::tan(friction));
    let turn = to - from;
    if from <= 0.0 || turn <= 0.0 || to >= std::f64::consts::PI {
        return f64::INFINITY;
    }
    let growth = libm::exp(turn * tan);
    let height = sin(to) * growth - sin(from);
    let crest = sin(turn) / sin(to) - sin(to + angle) / (sin(to) * sin(angle)) * height;
    if height <= FLATTEST || crest <= 0.0 {
        return f64::INFINITY;
    }
    let cubed = growth * growth * growth;
    let sector = ((3.0 * tan * cos(to) + sin(to)) * cubed - 3.0 * tan * cos(from) - sin(from))
        / (3.0 * (1.0 + 9.0 * tan * tan));
    let above = crest * (2.0 * cos(from) - crest) * sin(from) / 6.0;
    let beside = growth * (sin(turn) - crest * sin(to)) * (cos(from) - crest + cos(to) * growth) / 6.0;
    let weight = sector - above - beside;
    // (exp(2 turn tan) - 1) / (2 tan), whose limit without friction is the turn.
    let dissipation = if tan > 0.0 { libm::expm1(2.0 * turn * tan) / (2.0 * tan) } else { turn };
    if weight <= 0.0 { f64::INFINITY } else { dissipation * height / weight }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chen's table as reproduced by an independent search (physics.json, `slope_FS` and
    /// `stability_numbers_gammaH_over_c`).
    #[test]
    fn it_meets_the_published_stability_numbers() {
        for (angle, friction, expected) in [
            (45.0, 0.0, 5.870082441884558),
            (45.0, 10.0, 9.309722611218396),
            (45.0, 20.0, 16.16094377791466),
            (45.0, 25.0, 22.896325886484853),
            (45.0, 30.0, 35.54047752123598),
            (60.0, 20.0, 10.391),
            (90.0, 0.0, 3.831),
            (90.0, 20.0, 5.505),
        ] {
            let found = stability_number(f64::to_radians(angle), f64::to_radians(friction));
            assert!((found / expected - 1.0).abs() < 1e-4, "{angle} {friction}: {found} is not {expected}");
        }
    }
}
