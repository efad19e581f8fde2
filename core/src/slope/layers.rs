//! Which material a point is of.

use crate::campaign::Layer;
use crate::points::Points;

/// Place of each point's material among [`crate::campaign::Model::materials`]: the first layer, from the top, whose
/// bottom lies below the point.
pub fn materials(layers: &[Layer], points: &Points) -> Vec<u16> {
    points.x.iter().zip(&points.y).map(|(&x, &y)| layer_at(layers, x, y)).collect()
}

/// 0 without layers.
fn layer_at(layers: &[Layer], x: f64, y: f64) -> u16 {
    let above = |layer: &Layer| layer.bottom.as_ref().is_none_or(|line| y > line.y_at(x));
    layers.iter().position(above).unwrap_or(0) as u16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::{Polyline, Soil};

    #[test]
    fn a_point_is_of_the_first_layer_whose_bottom_lies_below_it() {
        let soil = Soil {
            youngs_modulus_pa: 1e7,
            poissons_ratio: 0.3,
            cohesion_pa: None,
            friction_angle_rad: None,
            unit_weight_n_m3: Some(2e4),
            dilation_angle_rad: 0.0,
            tension_cutoff_pa: None,
            softening: None,
            porosity: 0.3,
            permeability_m_s: 1e-4,
        };
        let layer = |bottom| Layer { name: String::new(), bottom, soil };
        let dipping = Polyline::new(vec![[-10.0, 8.0], [0.0, -2.0]]).unwrap();
        let layers = [layer(Some(dipping)), layer(Some(Polyline::level(3.0))), layer(None)];
        // The middle layer pinches out where the dipping line falls below 3 m, at x = -5.
        for (x, y, expected) in
            [(-9.0, 9.0, 0), (-9.0, 6.5, 1), (-9.0, 2.0, 2), (-6.0, 3.5, 1), (-4.0, 2.5, 0), (-4.0, 1.5, 2)]
        {
            assert_eq!(layer_at(&layers, x, y), expected, "({x}, {y})");
        }
        assert_eq!(layer_at(&[], 0.0, 0.0), 0);
    }
}
