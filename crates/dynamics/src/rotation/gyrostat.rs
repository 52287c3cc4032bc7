//! The rotation of a gyrostat, a body in which wheels store a constant angular momentum `s`, body frame.
//!
//! With the total momentum `P = Π + s`, the motion without moments is `Ṗ = P × Ω`, `Ω = J⁻¹ (P − s)`, and a rotation by
//! `F` leads to `Fᵀ P`. Both rotations here keep `R P` to rounding, because only `F` is computed.

use lgvi_lie::{Quaternion, hat};
use nalgebra::{Matrix3, Vector3};

use super::{RelativeRotation, Unsolvable};
use crate::Inertia;

/// Largest number of Newton corrections of the discrete rotation.
const MAX_CORRECTIONS: u32 = 20;

/// Largest order of the series.
const MAX_ORDER: usize = 40;

/// Greatest product of rate and time of one series, for which its terms decrease at least fourfold.
const REACH: f64 = 0.25;

/// Largest number of series in a row.
const MAX_SERIES: f64 = 1e4;

/// The data of a gyrostat.
#[derive(Clone, Debug)]
pub(crate) struct Gyrostat {
    inertia: Matrix3<f64>,
    inverse: Matrix3<f64>,
    /// `s`.
    pub(crate) stored: Vector3<f64>,
}

impl Gyrostat {
    pub(crate) fn new(inertia: &Inertia, stored: Vector3<f64>) -> Self {
        Self {
            inertia: *inertia.matrix(),
            inverse: *inertia.inverse(),
            stored,
        }
    }

    /// The rotation of the discrete mechanics over `h`, from the momentum `Π` at its beginning, and the number of Newton
    /// corrections.
    ///
    /// The discrete Lagrangian of body and wheels is `tr[(I − F) J_d]/h + Σ (I_i/2h) (a_i·φ + Δθ_i)²` with `φ = ½ vee(F −
    /// Fᵀ)`, of second order in h. The angles `θ_i` are cyclic, so that `h_i = I_i (a_i·φ + Δθ_i)/h` is constant. The
    /// momentum at the beginning then is `h S(P) = F J_d − J_d Fᵀ + ½ h S((tr[F] I − Fᵀ) s)`. For `F = cay(f)`, multiplied
    /// by `1 + |f|²`, it is `2 (J f + f × J f) + h (f × s − (f·s) f − |f|² s) = h (1 + |f|²) Π`.
    pub(crate) fn discrete(
        &self,
        h: f64,
        momentum: &Vector3<f64>,
    ) -> Result<(Quaternion, u32), Unsolvable> {
        let RelativeRotation { cayley, iterations } = self.relative(h, momentum)?;
        Ok((Quaternion::from_cayley(&cayley), iterations))
    }

    /// [`Gyrostat::discrete`] as a Cayley vector.
    pub(super) fn relative(
        &self,
        h: f64,
        momentum: &Vector3<f64>,
    ) -> Result<RelativeRotation, Unsolvable> {
        let (j, s, p) = (&self.inertia, h * self.stored, h * momentum);
        let first = 0.5 * (self.inverse * p);
        let mut f = first;
        let mut last = f64::INFINITY;
        for correction in 1..=MAX_CORRECTIONS {
            let jf = j * f;
            let squared = f.norm_squared();
            let residual = 2.0 * (jf + f.cross(&jf)) + f.cross(&s)
                - f.dot(&s) * f
                - squared * s
                - (1.0 + squared) * p;
            let slope = 2.0 * (j + hat(&f) * j - hat(&jf))
                - hat(&s)
                - f * s.transpose()
                - Matrix3::from_diagonal_element(f.dot(&s))
                - 2.0 * (s + p) * f.transpose();
            let Some(inverse) = slope.try_inverse() else {
                break;
            };
            let change = inverse * residual;
            f -= change;
            let size = change.norm();
            // The last correction is at rounding level when it no longer decreases.
            if size <= 1e-9 * f.norm() && (size <= 1e-15 * f.norm() || size >= 0.5 * last) {
                return match f.norm() <= 1.0 {
                    true => Ok(RelativeRotation {
                        cayley: f,
                        iterations: correction,
                    }),
                    false => Err(beyond(2.0 * first.norm())),
                };
            }
            last = size;
        }
        Err(beyond(2.0 * first.norm()))
    }

    /// The exact rotation over `h` from the momentum `Π`, to rounding: Taylor series in time, as many in a row as it takes.
    pub(crate) fn exact(&self, h: f64, momentum: &Vector3<f64>) -> Result<Quaternion, Unsolvable> {
        let rate = self.inverse.norm() * (3.0 * momentum.norm() + 4.0 * self.stored.norm());
        let turn = rate * h.abs();
        if turn.is_nan() || turn > MAX_SERIES * REACH {
            return Err(beyond(turn));
        }
        let count = (turn / REACH).ceil().max(1.0);
        let (mut rotation, mut p) = (Quaternion::IDENTITY, *momentum);
        for _ in 0..count as u64 {
            let part = self.series(h / count, &p);
            p = part.rotate_back(&(p + self.stored)) - self.stored;
            rotation = rotation.product(&part);
        }
        Ok(rotation)
    }

    /// The rotation over a short time, from the Taylor series of its quaternion: `q̇ = ½ q Ω`.
    fn series(&self, h: f64, momentum: &Vector3<f64>) -> Quaternion {
        let mut p = [Vector3::zeros(); MAX_ORDER];
        let mut omega = p;
        let (mut w, mut u) = ([0.0; MAX_ORDER], p);
        (p[0], w[0]) = (*momentum, 1.0);
        omega[0] = self.inverse * momentum;
        let mut sum = Quaternion::IDENTITY;
        for k in 1..MAX_ORDER {
            let mut dp = self.stored.cross(&omega[k - 1]);
            let (mut dw, mut du) = (0.0, Vector3::zeros());
            for i in 0..k {
                let omega = &omega[k - 1 - i];
                dp += p[i].cross(omega);
                dw -= u[i].dot(omega);
                du += w[i] * omega + u[i].cross(omega);
            }
            let factor = h / k as f64;
            p[k] = factor * dp;
            omega[k] = self.inverse * p[k];
            w[k] = 0.5 * factor * dw;
            u[k] = 0.5 * factor * du;
            sum.w += w[k];
            sum.u += u[k];
            let small = |k: usize| w[k].abs() + u[k].norm() <= 0.05 * f64::EPSILON * sum.u.norm();
            if k > 1 && small(k) && small(k - 1) {
                break;
            }
        }
        sum
    }
}

/// The error of a gyrostat that would turn by about `turn`.
fn beyond(turn: f64) -> Unsolvable {
    Unsolvable {
        turn,
        margin: 1.0 - turn,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rotation::{self, FreeRotation};

    fn random(rng: &mut fastrand::Rng, scale: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| scale * (2.0 * rng.f64() - 1.0))
    }

    fn inertia(rng: &mut fastrand::Rng) -> Inertia {
        let turn = lgvi_lie::exp(&random(rng, 3.0));
        let [a, b, c] = [0.1 + rng.f64(), 0.1 + rng.f64(), 0.1 + rng.f64()];
        let moments = Matrix3::from_diagonal(&Vector3::new(b + c, c + a, a + b));
        Inertia::new(turn * moments * turn.transpose()).unwrap()
    }

    #[test]
    fn without_stored_momentum_it_is_the_rotation_of_a_rigid_body() {
        let mut rng = fastrand::Rng::with_seed(4);
        for _ in 0..200 {
            let inertia = inertia(&mut rng);
            let gyrostat = Gyrostat::new(&inertia, Vector3::zeros());
            let p = inertia.matrix() * random(&mut rng, 2.0);
            let h = 0.2 * rng.f64();
            let (discrete, _) = gyrostat.discrete(h, &p).unwrap();
            let expected = rotation::solve(&inertia, &(h * p)).unwrap().matrix();
            assert!((discrete.matrix() - expected).norm() < 1e-14);
            let (expected, _): (Quaternion, Vector3<f64>) = FreeRotation::new(&inertia).flow(&p, h);
            let exact = gyrostat.exact(h, &p).unwrap();
            assert!((exact.matrix() - expected.matrix()).norm() < 3e-15);
        }
    }

    /// `h S(P) = F J_d − J_d Fᵀ + ½ h S((tr[F] I − Fᵀ) s)`.
    #[test]
    fn the_discrete_rotation_solves_its_equation() {
        let mut rng = fastrand::Rng::with_seed(5);
        for _ in 0..500 {
            let inertia = inertia(&mut rng);
            let stored = random(&mut rng, 5.0);
            // Also of bodies that hardly turn, as in a hold of their attitude.
            let slow = libm::pow(10.0, -16.0 * rng.f64());
            let momentum = inertia.matrix() * random(&mut rng, slow);
            let h = 0.1 * rng.f64();
            let gyrostat = Gyrostat::new(&inertia, stored);
            let (rotation, _) = gyrostat.discrete(h, &momentum).unwrap();
            let p = momentum + stored;
            let (f, j_d) = (rotation.matrix(), inertia.nonstandard());
            let wheels = Matrix3::from_diagonal_element(f.trace()) - f.transpose();
            let found = f * j_d - j_d * f.transpose() + 0.5 * h * hat(&(wheels * stored));
            assert!((found - h * hat(&p)).norm() < 4e-15 * (j_d.norm() + h * stored.norm()));
        }
    }

    /// Many short series and one long chain of them agree, and so do the halves of a time.
    #[test]
    fn the_exact_rotation_is_a_flow() {
        let mut rng = fastrand::Rng::with_seed(6);
        for _ in 0..200 {
            let inertia = inertia(&mut rng);
            let stored = random(&mut rng, 3.0);
            let gyrostat = Gyrostat::new(&inertia, stored);
            let p = inertia.matrix() * random(&mut rng, 1.0);
            let h = 2.0 * rng.f64() - 1.0;
            let whole = gyrostat.exact(h, &p).unwrap();
            let first = gyrostat.exact(0.3 * h, &p).unwrap();
            let second = gyrostat
                .exact(0.7 * h, &(first.rotate_back(&(p + stored)) - stored))
                .unwrap();
            let parts = first.product(&second).matrix();
            assert!((whole.matrix() - parts).norm() < 1e-13, "{h}");
        }
    }

    #[test]
    fn a_turn_too_far_is_refused() {
        let inertia = Inertia::principal([1.0, 1.2, 1.5]).unwrap();
        let gyrostat = Gyrostat::new(&inertia, Vector3::new(0.0, 1.0, 0.0));
        for p in [Vector3::new(1e3, 0.0, 0.0), Vector3::new(0.0, 1e200, 1.0)] {
            assert!(gyrostat.discrete(1.0, &p).unwrap_err().turn > 1.0);
        }
        let error = gyrostat
            .exact(1.0, &Vector3::new(1e9, 0.0, 0.0))
            .unwrap_err();
        assert!(error.turn > 1e9);
        assert!(
            gyrostat
                .exact(1.0, &Vector3::new(f64::NAN, 0.0, 0.0))
                .is_err()
        );
    }
}
