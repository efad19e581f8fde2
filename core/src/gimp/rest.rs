//! When the material is at rest.
//!
//! Two rules. Relative: the kinetic energy has been below a share of the largest it has had for `hold_s` without a
//! break (failed slopes). Absolute: over a window of `hold_s` the points have moved, in the root mean square, by less
//! than a limiting velocity times the window (stable slopes, whose largest kinetic energy is small itself). What the
//! absolute rule sees is net movement: an undamped slope rings elastically at some mm/s for ever without going
//! anywhere.

/// The rules for rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestRule {
    /// Kinetic energy over its maximum.
    pub kinetic_energy_share: f64,
    /// Root mean square over the points of net displacement over time in a window of `hold_s`, m/s.
    pub velocity_m_s: f64,
    /// How long the relative rule must hold, and the window of the absolute one, s.
    pub hold_s: f64,
}

/// Follows an analysis and tells when it has come to rest.
#[derive(Debug, Clone)]
pub(super) struct RestWatch {
    rule: RestRule,
    largest_energy: f64,
    /// Since when the relative rule has held, s.
    quiet_since: Option<f64>,
    window_start: f64,
    /// Positions at the start of the window, m.
    window_positions: Vec<[f64; 2]>,
}

impl RestWatch {
    /// Starts at time 0 with these positions.
    pub(super) fn new(rule: RestRule, positions: Vec<[f64; 2]>) -> RestWatch {
        RestWatch {
            rule,
            largest_energy: 0.0,
            quiet_since: None,
            window_start: 0.0,
            window_positions: positions,
        }
    }

    /// Takes in the kinetic energy (J per m) at `time_s` and, where a window ends, the positions; if a rule has held
    /// long enough, since when.
    pub(super) fn observe(
        &mut self,
        time_s: f64,
        kinetic_energy: f64,
        positions: impl FnOnce() -> Vec<[f64; 2]>,
    ) -> Option<f64> {
        self.largest_energy = self.largest_energy.max(kinetic_energy);
        if kinetic_energy < self.rule.kinetic_energy_share * self.largest_energy {
            let since = *self.quiet_since.get_or_insert(time_s);
            if time_s - since >= self.rule.hold_s {
                return Some(since);
            }
        } else {
            self.quiet_since = None;
        }
        if time_s - self.window_start < self.rule.hold_s {
            return None;
        }
        let now = positions();
        let velocity = net_velocity(&self.window_positions, &now, time_s - self.window_start);
        if velocity < self.rule.velocity_m_s {
            return Some(self.window_start);
        }
        (self.window_start, self.window_positions) = (time_s, now);
        None
    }
}

/// Root mean square over the points of displacement over time between two sets of positions, m/s; 0 of nothing.
pub fn net_velocity(before: &[[f64; 2]], after: &[[f64; 2]], time_s: f64) -> f64 {
    if time_s <= 0.0 || before.is_empty() {
        return 0.0;
    }
    let square: f64 = before
        .iter()
        .zip(after)
        .map(|(a, b)| (b[0] - a[0]) * (b[0] - a[0]) + (b[1] - a[1]) * (b[1] - a[1]))
        .sum();
    (square / before.len() as f64).sqrt() / time_s
}

#[cfg(test)]
mod tests {
    use super::*;

    const RULE: RestRule = RestRule { kinetic_energy_share: 1e-3, velocity_m_s: 1e-3, hold_s: 0.5 };

    #[test]
    fn a_slide_is_at_rest_half_a_second_after_its_energy_fell_below_the_share() {
        let mut watch = RestWatch::new(RULE, vec![[0.0; 2]]);
        let mut observe = |t: f64, energy: f64| watch.observe(t, energy, || vec![[t, 0.0]]);
        assert_eq!(observe(1.0, 100.0), None);
        assert_eq!(observe(2.0, 0.05), None);
        assert_eq!(observe(2.2, 0.2), None, "above the share again: the wait starts anew");
        assert_eq!(observe(2.3, 0.05), None);
        assert_eq!(observe(2.8, 0.05), Some(2.3));
    }

    #[test]
    fn a_ringing_slope_is_at_rest_if_it_goes_nowhere() {
        let mut watch = RestWatch::new(RULE, vec![[0.0; 2]]);
        assert_eq!(watch.observe(0.3, 1.0, || unreachable!("no window ends here")), None);
        assert_eq!(watch.observe(0.5, 1.0, || vec![[6e-4, 0.0]]), None, "1.2 mm/s");
        assert_eq!(watch.observe(1.0, 1.0, || vec![[2e-4, 0.0]]), Some(0.5), "0.8 mm/s");
    }
}
