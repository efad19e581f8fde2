//! Contact of the nodes with frictional walls and obstacles.

/// A frictional wall along a grid line.
#[derive(Debug, Clone, Copy)]
pub(super) struct Contact {
    /// Axis of its normal: 0 or 1.
    pub(super) axis: usize,
    /// 1 if the material lies on the side of larger coordinates, else -1.
    pub(super) inward: f64,
    /// Coulomb coefficient.
    pub(super) coefficient: f64,
}

/// What a node's masses do in contact with a wall.
pub(super) struct Touching {
    /// Masses of skeleton and water.
    pub(super) mass: [f64; 2],
    /// Impulse of the wall's effective reaction.
    pub(super) push: f64,
    /// Change of the velocities of skeleton and water by an impulse on the skeleton, drag included.
    pub(super) answer: [f64; 2],
}

/// Contact with a wall where the skeleton moves into it: the normal velocities are taken away, and Coulomb friction
/// acts on the skeleton, up to what stops it. Skeleton that moves off is free; water never passes. Returns the energy
/// this takes.
///
/// What arrives with a normal velocity is stopped (an elastic block loses a quarter of its energy in an impact); the
/// work of the stresses on it does not count, since the strains see a wall at rest.
#[inline(always)]
pub(super) fn touch(rates: &mut [f64; 8], contact: Contact, touching: &Touching) -> f64 {
    let (normal, tangential) = (contact.axis, 1 - contact.axis);
    let mut taken = 0.0;
    if rates[4 + normal] * contact.inward < 0.0 {
        let sliding = rates[4 + tangential];
        let least = contact.coefficient * touching.push.max(0.0);
        let impulse = least.min(sliding.abs() / touching.answer[0]);
        let impulse = if sliding < 0.0 { impulse } else { -impulse };
        let stops = impulse.abs() < least;
        for (phase, answer) in touching.answer.into_iter().enumerate() {
            let i = 2 * phase + tangential;
            let before = 2.0 * rates[4 + i] - rates[i];
            let change = answer * impulse;
            rates[i] += change;
            rates[4 + i] += change;
            // Mean of the velocities at the start and at the end, twice: (new - change of the step) + new.
            taken -= 0.5 * touching.mass[phase] * change * (before + change);
        }
        if stops {
            rates[4 + tangential] = 0.0;
        }
        taken += stop(rates, normal, touching.mass[0]);
    }
    if rates[6 + normal] * contact.inward < 0.0 {
        taken += stop(rates, 2 + normal, touching.mass[1]);
    }
    taken
}

/// Takes the velocity u of component `i` away; returns the energy that the points lose by it: to first order in the change
/// that reaches a point, M u^2, the momentum M u times the change u. (The node's own energy, M u^2 / 2, is less: elsewhere
/// the strains, which see the velocities at the end of the step, make up for the difference, but not at a wall at rest.)
#[inline(always)]
fn stop(rates: &mut [f64; 8], i: usize, mass: f64) -> f64 {
    let arriving = rates[4 + i] - rates[i];
    rates[i] = -arriving;
    rates[4 + i] = 0.0;
    mass * arriving * arriving
}

/// Keeps the velocities of the second scatter to what the contact decided: nothing moves into the wall, what touches it
/// does not lift off either (its stress would not fall while it does, which makes energy), what sticks does not slide.
#[inline(always)]
pub(super) fn hold_off(v: &mut [f64; 4], rates: &[f64; 8], contact: Contact) {
    let (normal, tangential) = (contact.axis, 1 - contact.axis);
    for phase in [0, 2] {
        let touches = rates[4 + phase + normal] == 0.0;
        if touches || v[phase + normal] * contact.inward < 0.0 {
            v[phase + normal] = 0.0;
        }
    }
    if rates[4] == 0.0 && rates[5] == 0.0 {
        v[tangential] = 0.0;
    }
}
