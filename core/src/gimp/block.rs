//! The material points in memory: blocks of eight, one cache line a quantity, sorted by cell.

use super::lanes::V8;

macro_rules! block {
    ($(#[$head:meta])* $block:ident: $($(#[$doc:meta])* $name:ident,)*) => {
        $(#[$head])*
        #[derive(Debug, Clone)]
        #[repr(C)]
        pub(super) struct $block {
            $($(#[$doc])* pub(super) $name: V8,)*
        }

        impl $block {
            pub(super) const EMPTY: $block = $block { $($name: V8::ZERO,)* };

            /// Takes over eight points of `blocks` by their places.
            pub(super) fn take_points(&mut self, blocks: &[$block], places: [usize; 8]) {
                let from = places.map(|place| (&blocks[place / 8], place % 8));
                $(self.$name.0 = from.map(|(block, lane)| block.$name.0[lane]);)*
            }
        }
    };
}

block! {
    /// Eight material points.
    Block:
    /// Position, m.
    x,
    /// Position, m.
    y,
    /// Velocity of the skeleton (of everything, if there is one phase), m/s.
    vx,
    /// As `vx`.
    vy,
    /// Velocity of the water, m/s.
    wx,
    /// As `wx`.
    wy,
    /// Move of this step, m.
    dx,
    /// Move of this step, m.
    dy,
    /// Gradient of the skeleton's displacement in this step: d(dx)/dx.
    lxx,
    /// d(dx)/dy.
    lxy,
    /// d(dy)/dx.
    lyx,
    /// d(dy)/dy.
    lyy,
    /// Divergence of the water's displacement in this step.
    water_divergence,
    /// Effective stress (total, if there is one phase), tension positive, Pa.
    sxx,
    /// As `sxx`.
    syy,
    /// As `sxx`.
    szz,
    /// As `sxx`.
    sxy,
    /// Carried pore pressure, compression positive, Pa: below the limit of cavitation it measures the void (see `water`).
    pressure,
    /// Volume per metre of width, m2.
    volume,
    /// Volume of the grains, which stays, m2 (0 if there is one phase).
    grains,
    /// Mass of the skeleton (of everything, if there is one phase) per metre of width, kg/m.
    mass,
    /// Bulk modulus of the skeleton, Pa.
    bulk,
    /// Shear modulus of the skeleton, Pa.
    shear,
    /// Sine of the dilation angle.
    sin_psi,
    /// Sine of the friction angle.
    sin_phi,
    /// 2 c cos phi, Pa.
    two_c_cos_phi,
    /// Mean stress at the apex, c cot phi, Pa.
    apex,
    /// Largest tensile principal stress, Pa.
    tension,
    /// Equivalent deviatoric plastic strain.
    plastic_strain,
}

block! {
    /// What only some analyses need to know of eight points: softening, domains that stretch, loads of their own.
    Extra:
    /// Peak cohesion, Pa.
    cohesion,
    /// Peak friction angle, rad.
    friction_angle,
    /// Peak dilation angle, rad.
    dilation_angle,
    /// Tension cut-off, Pa; infinite if there is none.
    tension_cutoff,
    /// Residual over peak cohesion.
    residual_cohesion,
    /// Residual over peak friction angle.
    residual_friction_angle,
    /// Residual over peak dilation angle.
    residual_dilation_angle,
    /// Decay of what is left of the peak strength per equivalent plastic strain.
    softening_rate,
    /// What is left of the difference between peak and residual strength, from 1 to 0.
    peak_left,
    /// Half the sides of the point's domain, in cells.
    half_x,
    /// As `half_x`.
    half_y,
    /// Gravity over hydraulic conductivity, 1/s: drag per mass of water and relative velocity.
    drag_rate,
    /// 1 where the skeleton holds the weight of the water, else 0.
    held,
    /// External force on the mixture, N per m of width.
    force_x,
    /// As `force_x`.
    force_y,
}
