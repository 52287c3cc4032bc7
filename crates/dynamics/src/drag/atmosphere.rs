use lgvi_lie::hat;
use nalgebra::{Matrix3, Vector3};

use super::DragError;

/// An atmosphere that turns uniformly, with the density of spherical layers.
///
/// Within a layer the logarithm of the density is linear in the altitude. The density is continuous. Below the first layer and
/// above the last it goes on as in that layer.
#[derive(Clone, Debug, PartialEq)]
pub struct Atmosphere {
    center: Vector3<f64>,
    rotation: Vector3<f64>,
    layers: Vec<Layer>,
}

/// The largest exponent of a density: deeper in a planet it would overflow.
const DEEPEST: f64 = 300.0;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Layer {
    /// Distance of its lower end from the center.
    bottom: f64,
    /// Density at its lower end.
    density: f64,
    /// Reciprocal of the scale height.
    decay: f64,
}

impl Atmosphere {
    /// Creates an atmosphere about `center` that turns with the angular velocity `rotation`, both in the inertial frame.
    ///
    /// `layers` are altitudes above a sphere of this radius, ascending, with the densities there. The last layer has the
    /// scale height `scale_height`.
    ///
    /// # Errors
    /// Returns an error if a number is not in its range.
    pub fn new(
        center: Vector3<f64>,
        rotation: Vector3<f64>,
        radius: f64,
        layers: &[[f64; 2]],
        scale_height: f64,
    ) -> Result<Self, DragError> {
        let places = center.iter().chain(&rotation).chain([&radius]);
        if !places.copied().all(f64::is_finite) {
            return Err(DragError::NotFinite);
        }
        if !(scale_height.is_finite() && scale_height > 0.0) {
            return Err(DragError::ScaleHeight(scale_height));
        }
        if layers.is_empty() {
            return Err(DragError::NoLayers);
        }
        let mut below = f64::NEG_INFINITY;
        for (index, &[altitude, density]) in layers.iter().enumerate() {
            if !(density.is_finite() && density > 0.0) {
                return Err(DragError::Density { index, density });
            }
            if !(altitude.is_finite() && altitude > below) {
                return Err(DragError::Altitude { index, altitude });
            }
            below = altitude;
        }
        let decay = |index: usize| match layers.get(index + 1) {
            Some(&[top, thinner]) => {
                let [bottom, density] = layers[index];
                (libm::log(density) - libm::log(thinner)) / (top - bottom)
            }
            None => scale_height.recip(),
        };
        let each = layers.iter().enumerate();
        let layers: Vec<_> = each
            .map(|(index, &[altitude, density])| Layer {
                bottom: radius + altitude,
                density,
                decay: decay(index),
            })
            .collect();
        let finite = |layer: &Layer| layer.bottom.is_finite() && layer.decay.is_finite();
        if !layers.iter().all(finite) {
            return Err(DragError::NotFinite);
        }
        Ok(Self {
            center,
            rotation,
            layers,
        })
    }

    /// The density at a position, inertial frame.
    pub fn density(&self, position: &Vector3<f64>) -> f64 {
        let distance = (position - self.center).norm();
        let Layer {
            bottom,
            density,
            decay,
        } = self.layer_at(distance);
        density * libm::exp((-decay * (distance - bottom)).min(DEEPEST))
    }

    /// The layer at a distance from the center, or the first below all.
    fn layer_at(&self, distance: f64) -> &Layer {
        let above = self
            .layers
            .partition_point(|layer| layer.bottom <= distance);
        &self.layers[above.saturating_sub(1)]
    }

    /// The velocity of the air at a position, inertial frame.
    pub fn wind(&self, position: &Vector3<f64>) -> Vector3<f64> {
        self.rotation.cross(&(position - self.center))
    }

    /// The slope and the second derivatives by the position of the logarithm of the density, `−β n` and `−β/r (I − n nᵀ)` with
    /// the reciprocal β of the scale height and the direction n from the center.
    pub(super) fn log_slopes(&self, position: &Vector3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
        let from = position - self.center;
        let distance = from.norm();
        if distance == 0.0 {
            return (Vector3::zeros(), Matrix3::zeros());
        }
        let Layer { decay, .. } = self.layer_at(distance);
        let up = from / distance;
        let across = Matrix3::identity() - up * up.transpose();
        (-*decay * up, (-*decay / distance) * across)
    }

    /// The wind by the position, `S(ω)`.
    pub(super) fn wind_gradient(&self) -> Matrix3<f64> {
        hat(&self.rotation)
    }

    /// The atmosphere in other units, of these sizes.
    pub(super) fn in_units(&self, length: f64, mass: f64, time: f64) -> Self {
        let volume = length * length * length;
        let each = self.layers.iter();
        Self {
            center: self.center / length,
            rotation: self.rotation * time,
            layers: each
                .map(|layer| Layer {
                    bottom: layer.bottom / length,
                    density: layer.density * volume / mass,
                    decay: layer.decay * length,
                })
                .collect(),
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::drag::Drag;

    pub(in crate::drag) fn atmosphere(
        layers: &[[f64; 2]],
        scale_height: f64,
    ) -> Result<Atmosphere, DragError> {
        let center = Vector3::new(0.5, -0.25, 1.0);
        let rotation = Vector3::new(0.0, 0.1, 0.2);
        Atmosphere::new(center, rotation, 10.0, layers, scale_height)
    }

    pub(in crate::drag) fn above(altitude: f64) -> Vector3<f64> {
        Vector3::new(0.5, -0.25, 1.0) + (10.0 + altitude) * Vector3::new(0.6, 0.0, -0.8)
    }

    #[test]
    fn the_density_is_continuous_and_has_the_values_of_the_table() {
        let layers = [[0.0, 1.5], [1.0, 0.5], [3.0, 0.25]];
        let air = atmosphere(&layers, 4.0).unwrap();
        for [altitude, density] in layers {
            for near in [-1e-12, 1e-12] {
                let found = air.density(&above(altitude + near));
                assert!((found - density).abs() < 1e-11, "{altitude}: {found}");
            }
        }
        let between = air.density(&above(2.0));
        assert!((between - libm::sqrt(0.5 * 0.25)).abs() < 1e-14);
        let beyond = air.density(&above(7.0));
        assert!((beyond - 0.25 * libm::exp(-1.0)).abs() < 1e-14);
        let below = air.density(&above(-1.0));
        assert!((below - 4.5).abs() < 1e-13, "{below}");
        let thin = atmosphere(&[[0.0, 1.5]], 1e-3).unwrap();
        assert!(thin.density(&above(-10.0)).is_finite());
    }

    #[test]
    fn what_is_no_atmosphere_is_refused() {
        let refused = |layers: &[[f64; 2]], height| atmosphere(layers, height).unwrap_err();
        assert_eq!(refused(&[], 1.0), DragError::NoLayers);
        assert_eq!(refused(&[[0.0, 1.0]], -1.0), DragError::ScaleHeight(-1.0));
        let (index, altitude) = (1, 0.0);
        assert_eq!(
            refused(&[[0.0, 1.0], [0.0, 0.5]], 1.0),
            DragError::Altitude { index, altitude }
        );
        let density = 0.0;
        assert_eq!(
            refused(&[[0.0, 1.0], [1.0, 0.0]], 1.0),
            DragError::Density { index, density }
        );
        assert_eq!(refused(&[[0.0, 1.0]], 1e-310), DragError::NotFinite);
        assert!(matches!(
            refused(&[[f64::NAN, 1.0]], 1.0),
            DragError::Altitude { index: 0, .. }
        ));
        let air = Arc::new(atmosphere(&[[0.0, 1.0]], 1.0).unwrap());
        assert_eq!(Drag::new(air, 0.0), Err(DragError::Area(0.0)));
    }
}
