//! Linear elasticity with a Mohr-Coulomb yield surface and a Rankine tension cut-off, in plane strain.
//!
//! Stresses are tension positive. The stress is rotated by the step's spin (Hughes & Winget 1980), an elastic
//! predictor follows, then the return in principal space with sigma_zz one of the three: to the plane, to one of
//! the edges, or to the apex (de Souza Neto, Peric & Owen 2008, "Computational methods for plasticity", box 8.4,
//! for perfect plasticity), then the associated Rankine return. All branches are computed and selected lane by lane.

mod softening;

pub(super) use softening::{decay, softened};

use super::lanes::Lanes;

/// Elastic constants and dilation of eight points.
#[derive(Clone, Copy)]
pub(super) struct Elastic<S> {
    /// Bulk modulus, Pa.
    pub(super) bulk: S,
    /// Shear modulus, Pa.
    pub(super) shear: S,
    /// Sine of the dilation angle.
    pub(super) sin_psi: S,
}

impl<S: Lanes> Elastic<S> {
    /// Lame's first constant, Pa.
    #[inline(always)]
    fn lame(&self) -> S {
        S::splat(-2.0 / 3.0).mul_add(self.shear, self.bulk)
    }
}

/// Strength of eight points.
#[derive(Clone, Copy)]
pub(super) struct Strength<S> {
    pub(super) sin_phi: S,
    pub(super) two_c_cos_phi: S,
    pub(super) apex: S,
    pub(super) tension: S,
}

/// Stress of eight points, Pa.
#[derive(Clone, Copy)]
pub(super) struct Stress<S> {
    pub(super) xx: S,
    pub(super) yy: S,
    pub(super) zz: S,
    pub(super) xy: S,
}

/// Displacement gradient of a step of eight points, and the volumetric strain increment the stresses shall see.
#[derive(Clone, Copy)]
pub(super) struct Increment<S> {
    pub(super) xx: S,
    pub(super) xy: S,
    pub(super) yx: S,
    pub(super) yy: S,
    pub(super) volumetric: S,
}

/// Guards a division by the radius of Mohr's circle, Pa; far below any stress that matters.
const SMALLEST_RADIUS_PA: f64 = 1e-30;

/// New stress and increment of the equivalent deviatoric plastic strain.
#[inline(always)]
pub(super) fn update<S: Lanes>(
    elastic: &Elastic<S>,
    strength: &Strength<S>,
    stress: Stress<S>,
    increment: &Increment<S>,
) -> (Stress<S>, S) {
    let trial = predict(elastic, rotate(stress, increment), increment);
    let zero = S::splat(0.0);

    // Principal stresses: in the plane about the centre of Mohr's circle, and sigma_zz.
    let half = S::splat(0.5);
    let centre = (trial.xx + trial.yy) * half;
    let across = (trial.xx - trial.yy) * half;
    let radius = across.mul_add(across, trial.xy * trial.xy).sqrt();
    let (major, minor) = (centre + radius, centre - radius);
    let s = [major.max(trial.zz), major.min(trial.zz).max(minor), minor.min(trial.zz)];
    let yields = S::or(excess(strength, s[0], s[2]).gt(zero), s[0].gt(strength.tension));
    if !S::any(yields) {
        return (trial, zero);
    }

    let t = cut_off(elastic, strength, return_to_surface(elastic, strength, s));
    // Back to axes: sigma_zz keeps its place in the order, the directions in the plane stay.
    let zz_first = trial.zz.gt(major);
    let zz_last = minor.gt(trial.zz);
    let new_major = S::select(zz_first, t[1], t[0]);
    let new_minor = S::select(zz_last, t[1], t[2]);
    let new_zz = S::select(zz_first, t[0], S::select(zz_last, t[2], t[1]));
    let new_centre = (new_major + new_minor) * half;
    let scale = (new_major - new_minor) * half / radius.max(S::splat(SMALLEST_RADIUS_PA));
    let pick = |a: S, b: S| S::select(yields, a, b);
    let returned = Stress {
        xx: pick(across.mul_add(scale, new_centre), trial.xx),
        yy: pick((-across).mul_add(scale, new_centre), trial.yy),
        zz: pick(new_zz, trial.zz),
        xy: pick(trial.xy * scale, trial.xy),
    };
    let strain = deviatoric_strain(elastic, [s[0] - t[0], s[1] - t[1], s[2] - t[2]]);
    (returned, pick(strain, zero))
}

/// Work per volume of the mean of two stresses on a step's strain, its volumetric part the one the stresses see, J/m3.
#[inline(always)]
pub(super) fn work<S: Lanes>(old: &Stress<S>, new: &Stress<S>, increment: &Increment<S>) -> S {
    let more = (increment.volumetric - increment.xx - increment.yy) * S::splat(1.0 / 3.0);
    let sum = (old.xx + new.xx).mul_add(increment.xx + more, (old.yy + new.yy) * (increment.yy + more));
    let sum = (old.zz + new.zz).mul_add(more, sum);
    (old.xy + new.xy).mul_add(increment.xy + increment.yx, sum) * S::splat(0.5)
}

/// Turns the stress by the step's spin: the Cayley form is an exact rotation, so invariants stay.
#[inline(always)]
fn rotate<S: Lanes>(stress: Stress<S>, increment: &Increment<S>) -> Stress<S> {
    let one = S::splat(1.0);
    let half_angle = (increment.yx - increment.xy) * S::splat(0.25);
    let square = half_angle * half_angle;
    let inverse = one / (one + square);
    let cos = (one - square) * inverse;
    let sin = (half_angle + half_angle) * inverse;
    let half = S::splat(0.5);
    let centre = (stress.xx + stress.yy) * half;
    let across = (stress.xx - stress.yy) * half;
    let cos_double = cos.mul_add(cos, -(sin * sin));
    let sin_double = (sin + sin) * cos;
    let turned = across.mul_add(cos_double, -(stress.xy * sin_double));
    Stress {
        xx: centre + turned,
        yy: centre - turned,
        zz: stress.zz,
        xy: across.mul_add(sin_double, stress.xy * cos_double),
    }
}

/// Elastic predictor: 2 G times the deviatoric strain of the point itself, K times the given volumetric strain.
#[inline(always)]
fn predict<S: Lanes>(elastic: &Elastic<S>, stress: Stress<S>, increment: &Increment<S>) -> Stress<S> {
    let shear = elastic.shear;
    let double_shear = shear + shear;
    let third = (increment.xx + increment.yy) * S::splat(1.0 / 3.0);
    let pressure = elastic.bulk * increment.volumetric;
    Stress {
        xx: double_shear.mul_add(increment.xx - third, stress.xx + pressure),
        yy: double_shear.mul_add(increment.yy - third, stress.yy + pressure),
        zz: double_shear.mul_add(-third, stress.zz + pressure),
        xy: shear.mul_add(increment.xy + increment.yx, stress.xy),
    }
}

/// Mohr-Coulomb function (a - b) + (a + b) sin phi - 2 c cos phi of two principal stresses a >= b.
#[inline(always)]
fn excess<S: Lanes>(strength: &Strength<S>, a: S, b: S) -> S {
    (a + b).mul_add(strength.sin_phi, a - b - strength.two_c_cos_phi)
}

/// Returns sorted principal stresses to the Mohr-Coulomb pyramid; admissible ones stay.
#[inline(always)]
fn return_to_surface<S: Lanes>(elastic: &Elastic<S>, strength: &Strength<S>, s: [S; 3]) -> [S; 3] {
    let one = S::splat(1.0);
    let sin_phi = strength.sin_phi;
    // Flow of the plane (1, 3): D dg/dsigma = (r1, r2, r3).
    let lame = elastic.lame();
    let double_shear = elastic.shear + elastic.shear;
    let r2 = (lame + lame) * elastic.sin_psi;
    let r1 = double_shear.mul_add(one + elastic.sin_psi, r2);
    let r3 = (-double_shear).mul_add(one - elastic.sin_psi, r2);
    let (up, down) = (one + sin_phi, one - sin_phi);
    let a = up.mul_add(r1, -(down * r3));

    let f13 = excess(strength, s[0], s[2]);
    let multiplier = f13 / a;
    let plane =
        [(-multiplier).mul_add(r1, s[0]), (-multiplier).mul_add(r2, s[1]), (-multiplier).mul_add(r3, s[2])];
    let beyond_right = plane[1].gt(plane[0]);
    let beyond_left = plane[2].gt(plane[1]);
    let off_plane = S::or(beyond_right, beyond_left);

    let yields = f13.gt(S::splat(0.0));
    let mut t = [
        S::select(yields, plane[0], s[0]),
        S::select(yields, plane[1], s[1]),
        S::select(yields, plane[2], s[2]),
    ];
    let beside = S::and(yields, off_plane);
    if S::any(beside) {
        let edge = return_to_edge(strength, s, [r1, r2, r3], f13, a, beyond_right);
        for i in 0..3 {
            t[i] = S::select(beside, edge[i], t[i]);
        }
    }
    t
}

/// Returns to the edge that the plane (1, 3) shares with a second plane, (2, 3) where s1 = s2 or (1, 2) where s2 = s3, or
/// to the apex; `flow` is that of the first plane, `f13` and `a` its excess and stiffness. The 2 x 2 system is symmetric.
#[inline(always)]
fn return_to_edge<S: Lanes>(
    strength: &Strength<S>,
    s: [S; 3],
    [r1, r2, r3]: [S; 3],
    f13: S,
    a: S,
    beyond_right: S::Mask,
) -> [S; 3] {
    let one = S::splat(1.0);
    let (up, down) = (one + strength.sin_phi, one - strength.sin_phi);
    let second = S::select(beyond_right, excess(strength, s[1], s[2]), excess(strength, s[0], s[1]));
    let b = S::select(beyond_right, up.mul_add(r2, -(down * r3)), up.mul_add(r1, -(down * r2)));
    let inverse = one / a.mul_add(a, -(b * b));
    let first_part = a.mul_add(f13, -(b * second)) * inverse;
    let second_part = a.mul_add(second, -(b * f13)) * inverse;
    let q =
        [S::select(beyond_right, r2, r1), S::select(beyond_right, r1, r3), S::select(beyond_right, r3, r2)];
    let mut edge = [
        s[0] - first_part.mul_add(r1, second_part * q[0]),
        s[1] - first_part.mul_add(r2, second_part * q[1]),
        s[2] - first_part.mul_add(r3, second_part * q[2]),
    ];
    // An edge ends where all three stresses meet. Without friction it never does but by rounding: the mean stays.
    let beyond_apex = edge[2].gt(edge[0]);
    let mean = (s[0] + s[1] + s[2]) * S::splat(1.0 / 3.0);
    let apex = strength.apex.min(mean);
    for stress in &mut edge {
        *stress = S::select(beyond_apex, apex, *stress);
    }
    edge
}

/// Associated Rankine return: one, two or three principal stresses at the cut-off. It cannot leave the
/// Mohr-Coulomb pyramid again: it lowers s1 by at least as much as s3.
#[inline(always)]
fn cut_off<S: Lanes>(elastic: &Elastic<S>, strength: &Strength<S>, t: [S; 3]) -> [S; 3] {
    let limit = strength.tension;
    let cut = t[0].gt(limit);
    if !S::any(cut) {
        return t;
    }
    let lame = elastic.lame();
    let stiff = lame + elastic.shear;
    let beside_one = lame / (stiff + elastic.shear);
    let beside_two = lame / (stiff + stiff);
    let over = t[0] - limit;
    let one = [limit, (-over).mul_add(beside_one, t[1]), (-over).mul_add(beside_one, t[2])];
    let both = over + (t[1] - limit);
    let two_last = (-both).mul_add(beside_two, t[2]);
    let two = one[1].gt(limit);
    let last = S::select(two, two_last.min(limit), one[2]);
    [
        S::select(cut, limit, t[0]),
        S::select(cut, S::select(two, limit, one[1]), t[1]),
        S::select(cut, last, t[2]),
    ]
}

/// sqrt(2/3 e:e) of the deviatoric plastic strain that the stress difference of a return stands for.
#[inline(always)]
fn deviatoric_strain<S: Lanes>(elastic: &Elastic<S>, difference: [S; 3]) -> S {
    let mean = (difference[0] + difference[1] + difference[2]) * S::splat(1.0 / 3.0);
    let d = [difference[0] - mean, difference[1] - mean, difference[2] - mean];
    let square = d[0].mul_add(d[0], d[1].mul_add(d[1], d[2] * d[2]));
    (square * S::splat(2.0 / 3.0)).sqrt() * S::splat(0.5) / elastic.shear
}

#[cfg(test)]
mod tests;
