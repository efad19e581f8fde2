//! When the material is at rest.
//!
//! Two rules. Relative, for slopes that have failed: the kinetic energy has been below a share of the largest it has
//! had for `hold_s` without a break. It counts once the material has moved so fast that the share of its energy stands
//! for more than the absolute rule's velocity: the small kick when strengths are set is no failure.
//!
//! Absolute, for slopes that stand: over [`QUIET_WINDOWS`] windows of `hold_s` in a row the points have moved, in the
//! root mean square, by less than a limiting velocity times the window, and in the later half no more than in the
//! earlier; and the pore pressure has settled: at the last window's rate it would change by less than a limit in the
//! time that is left. What this rule sees is net movement: an undamped slope rings elastically at some mm/s for ever
//! without going anywhere. Pore pressure must settle because suction holds wet slopes at first, and they fail when it
//! dissipates: a two-phase slope that ran 3.6 m had moved at less than 0.5 mm/s between 0.5 and 2 s.

/// How many windows in a row must be quiet for the absolute rule; even.
const QUIET_WINDOWS: usize = 4;

/// The rules for rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestRule {
    /// Kinetic energy over its maximum.
    pub kinetic_energy_share: f64,
    /// Root mean square over the points of net displacement over time in a window of `hold_s`, m/s.
    pub velocity_m_s: f64,
    /// How long the relative rule must hold, and the length of a window of the absolute one, s.
    pub hold_s: f64,
    /// Change of pore pressure (root mean square over the points) in the time left below which it has settled, Pa.
    pub pressure_change_pa: f64,
}

/// What the absolute rule looks at where a window ends, in the points' original order.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Stand {
    /// Positions, m.
    pub(super) positions: Vec<[f64; 2]>,
    /// Pore pressures, Pa.
    pub(super) pressures: Vec<f64>,
}

/// Follows an analysis and tells when it has come to rest.
#[derive(Debug, Clone)]
pub(super) struct RestWatch {
    rule: RestRule,
    /// Kinetic energy above which the relative rule counts, J per m.
    failed_energy: f64,
    largest_energy: f64,
    /// Since when the relative rule has held, s.
    quiet_since: Option<f64>,
    window_start: f64,
    /// As it was at the start of the window.
    window_stand: Stand,
    /// As it is at its end; kept so that looking allocates nothing.
    now: Stand,
    quiet: Quiet,
}

/// The quiet windows that have just passed without a break.
#[derive(Debug, Clone, Copy, Default)]
struct Quiet {
    /// Start of the first, s.
    since_s: f64,
    count: usize,
    /// Net velocities of the last ones, m/s, oldest first.
    velocities: [f64; QUIET_WINDOWS],
}

impl Quiet {
    fn add(&mut self, start_s: f64, velocity: f64) {
        if self.count == 0 {
            self.since_s = start_s;
        }
        self.count += 1;
        self.velocities.rotate_left(1);
        self.velocities[QUIET_WINDOWS - 1] = velocity;
    }

    /// Whether there are enough, the later half no faster than the earlier.
    fn holds(&self) -> bool {
        let (earlier, later) = self.velocities.split_at(QUIET_WINDOWS / 2);
        self.count >= QUIET_WINDOWS && later.iter().sum::<f64>() <= earlier.iter().sum()
    }
}

impl RestWatch {
    /// Starts at time 0 from `stand`, with points of `mass` (kg per m of width) altogether.
    pub(super) fn new(rule: RestRule, mass: f64, stand: Stand) -> RestWatch {
        RestWatch {
            rule,
            failed_energy: 0.5 * mass * rule.velocity_m_s * rule.velocity_m_s / rule.kinetic_energy_share,
            largest_energy: 0.0,
            quiet_since: None,
            window_start: 0.0,
            now: stand.clone(),
            window_stand: stand,
            quiet: Quiet::default(),
        }
    }

    /// Takes in the kinetic energy (J per m) at `time_s`, with `left_s` to go, and by `stand` how things stand where a window
    /// ends; if a rule has held long enough, since when.
    pub(super) fn observe(
        &mut self,
        time_s: f64,
        left_s: f64,
        kinetic_energy: f64,
        stand: impl FnOnce(&mut Stand),
    ) -> Option<f64> {
        self.largest_energy = self.largest_energy.max(kinetic_energy);
        let failed = self.largest_energy > self.failed_energy;
        if failed && kinetic_energy < self.rule.kinetic_energy_share * self.largest_energy {
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
        stand(&mut self.now);
        self.end_window(time_s, left_s)
    }

    /// The absolute rule, where a window ends.
    fn end_window(&mut self, time_s: f64, left_s: f64) -> Option<f64> {
        let now = &self.now;
        let window_s = time_s - self.window_start;
        let velocity = net_velocity(&self.window_stand.positions, &now.positions, window_s);
        let change_pa = pressure_rate(&self.window_stand.pressures, &now.pressures, window_s) * left_s;
        if velocity < self.rule.velocity_m_s {
            self.quiet.add(self.window_start, velocity);
        } else {
            self.quiet = Quiet::default();
        }
        self.window_start = time_s;
        std::mem::swap(&mut self.window_stand, &mut self.now);
        (self.quiet.holds() && change_pa < self.rule.pressure_change_pa).then_some(self.quiet.since_s)
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

/// Root mean square over the points of the change of pore pressure over time, Pa/s; 0 of nothing.
fn pressure_rate(before: &[f64], after: &[f64], time_s: f64) -> f64 {
    if time_s <= 0.0 || before.is_empty() {
        return 0.0;
    }
    let square: f64 = before.iter().zip(after).map(|(a, b)| (b - a) * (b - a)).sum();
    (square / before.len() as f64).sqrt() / time_s
}

#[cfg(test)]
mod tests {
    use super::*;

    const RULE: RestRule =
        RestRule { kinetic_energy_share: 1e-3, velocity_m_s: 1e-3, hold_s: 0.5, pressure_change_pa: 500.0 };

    fn at(x: f64, pressure: f64) -> Stand {
        Stand { positions: vec![[x, 0.0]], pressures: vec![pressure] }
    }

    #[test]
    fn a_slide_is_at_rest_half_a_second_after_its_energy_fell_below_the_share() {
        let mut watch = RestWatch::new(RULE, 1.0, at(0.0, 0.0));
        let mut observe = |t: f64, energy: f64| watch.observe(t, 10.0, energy, |stand| *stand = at(t, 0.0));
        assert_eq!(observe(1.0, 100.0), None);
        assert_eq!(observe(2.0, 0.05), None);
        assert_eq!(observe(2.2, 0.2), None, "above the share again: the wait starts anew");
        assert_eq!(observe(2.3, 0.05), None);
        assert_eq!(observe(2.8, 0.05), Some(2.3));
    }

    #[test]
    fn a_kick_that_dies_away_is_no_failure() {
        // 0.03 m/s at most: a thousandth of the energy is less than 1 mm/s.
        let mut watch = RestWatch::new(RULE, 2.0, at(0.0, 0.0));
        let mut observe = |t: f64, energy: f64| watch.observe(t, 10.0, energy, |stand| *stand = at(t, 0.0));
        assert_eq!(observe(0.1, 0.9e-3), None);
        assert_eq!(observe(0.2, 1e-9), None);
        assert_eq!(observe(0.9, 1e-9), None);
    }

    fn rest_after(positions: &[f64]) -> Option<(usize, f64)> {
        let mut watch = RestWatch::new(RULE, 1.0, at(0.0, 0.0));
        positions.iter().enumerate().find_map(|(window, &x)| {
            let since = watch.observe(0.5 * (window + 1) as f64, 10.0, 1.0, |stand| *stand = at(x, 0.0));
            since.map(|since| (window, since))
        })
    }

    #[test]
    fn a_ringing_slope_is_at_rest_if_it_goes_nowhere_for_four_windows() {
        assert_eq!(rest_after(&[6e-4, 2e-4, 3e-4, 2e-4, 3e-4]), Some((4, 0.5)));
    }

    #[test]
    fn a_slope_that_lies_quiet_and_then_creeps_faster_is_not() {
        assert_eq!(rest_after(&[2e-3, 2.1e-3, 2.3e-3, 2.6e-3, 3e-3, 4e-3, 6e-3]), None);
        assert_eq!(rest_after(&[2e-3, 2.1e-3, 2.2e-3, 4e-3, 4.1e-3]), None, "a window of 3.6 mm/s between");
    }

    #[test]
    fn a_quiet_slope_whose_pore_pressure_still_changes_is_not() {
        // 100 Pa a window of 0.5 s: 2 kPa in the ten seconds left, 0.4 kPa in the last two.
        let mut watch = RestWatch::new(RULE, 1.0, at(0.0, 0.0));
        let rest = (1..=20).find(|&window| {
            let time = 0.5 * f64::from(window);
            watch
                .observe(time, 10.0 - time, 1.0, |stand| *stand = at(0.0, 100.0 * f64::from(window)))
                .is_some()
        });
        assert_eq!(rest, Some(16));
    }
}
