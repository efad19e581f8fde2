//! When the material is at rest.
//!
//! Two rules, each of which must hold without a break for `hold_s`: kinetic energy below a share of the largest it
//! has had (failed slopes), or root mean square velocity below a limit (stable slopes, whose largest kinetic energy
//! is small itself).

/// The rules for rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestRule {
    /// Kinetic energy over its maximum.
    pub kinetic_energy_share: f64,
    /// Root mean square velocity, m/s.
    pub velocity_m_s: f64,
    /// How long a rule must hold, s.
    pub hold_s: f64,
}

/// Follows an analysis and tells when it has come to rest.
#[derive(Debug, Clone, Copy)]
pub(super) struct RestWatch {
    rule: RestRule,
    mass: f64,
    largest_energy: f64,
    relative_since: Option<f64>,
    absolute_since: Option<f64>,
}

impl RestWatch {
    /// `mass`: of everything, kg per m of width.
    pub(super) fn new(rule: RestRule, mass: f64) -> RestWatch {
        RestWatch { rule, mass, largest_energy: 0.0, relative_since: None, absolute_since: None }
    }

    /// Takes in the kinetic energy (J per m) at `time_s`; if a rule has held long enough, since when.
    pub(super) fn observe(&mut self, time_s: f64, kinetic_energy: f64) -> Option<f64> {
        self.largest_energy = self.largest_energy.max(kinetic_energy);
        let velocity = (2.0 * kinetic_energy / self.mass).sqrt();
        let relative = kinetic_energy < self.rule.kinetic_energy_share * self.largest_energy;
        let absolute = velocity < self.rule.velocity_m_s;
        follow(&mut self.relative_since, relative, time_s);
        follow(&mut self.absolute_since, absolute, time_s);
        let held = |since: Option<f64>| since.filter(|s| time_s - s >= self.rule.hold_s);
        match (held(self.relative_since), held(self.absolute_since)) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        }
    }
}

fn follow(since: &mut Option<f64>, holds: bool, time_s: f64) {
    match (holds, *since) {
        (true, None) => *since = Some(time_s),
        (false, _) => *since = None,
        (true, Some(_)) => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RULE: RestRule = RestRule { kinetic_energy_share: 1e-3, velocity_m_s: 1e-3, hold_s: 0.5 };

    #[test]
    fn a_slide_is_at_rest_half_a_second_after_its_energy_fell_below_the_share() {
        let mut watch = RestWatch::new(RULE, 1.0);
        assert_eq!(watch.observe(1.0, 100.0), None);
        assert_eq!(watch.observe(2.0, 0.05), None);
        assert_eq!(watch.observe(2.2, 0.2), None, "above the share again: the wait starts anew");
        assert_eq!(watch.observe(2.3, 0.05), None);
        assert_eq!(watch.observe(2.8, 0.05), Some(2.3));
    }

    #[test]
    fn a_stable_slope_is_at_rest_by_the_absolute_rule() {
        let mut watch = RestWatch::new(RULE, 2.0);
        assert_eq!(watch.observe(0.1, 0.9e-6), None);
        assert_eq!(watch.observe(0.6, 0.9e-6), Some(0.1));
    }
}
