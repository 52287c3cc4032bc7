//! Derivatives of the motion of a center of mass with drag.

use nalgebra::{Matrix3, Vector3};

use super::Drag;
use crate::{BodyState, RigidBody};

/// Derivatives of position and linear momentum by position and linear momentum, or of a number by these twice.
pub type Blocks = [[Matrix3<f64>; 2]; 2];

/// The drag over a time at a fixed position: what its derivatives have in common.
///
/// With the velocity `w` relative to the air, its size s, `κ = ρ C_D A/(2m)` and `d = 1 + κ s t` it is `γ⁺ = m (S(ω) (x − c) + f)`,
/// `f = w/d`.
struct Slowing {
    mass: f64,
    time: f64,
    /// `S(ω) (x − c)`
    wind: Vector3<f64>,
    /// `w`
    relative: Vector3<f64>,
    /// `s`
    speed: f64,
    /// `w/s`, or 0 at rest.
    direction: Vector3<f64>,
    /// `κ`
    rate: f64,
    /// `d`
    slower: f64,
    /// The slope and the second derivatives of `ln κ`.
    log_slopes: (Vector3<f64>, Matrix3<f64>),
    /// `S(ω)`
    turning: Matrix3<f64>,
}

impl Slowing {
    fn new(drag: &Drag, mass: f64, state: &BodyState, [time, factor]: [f64; 2]) -> Self {
        let atmosphere = &drag.atmosphere;
        let wind = atmosphere.wind(&state.position);
        let relative = state.linear_momentum / mass - wind;
        let speed = relative.norm();
        let rate = factor * drag.rate(mass, &state.position);
        Self {
            mass,
            time,
            wind,
            relative,
            speed,
            direction: if speed > 0.0 {
                relative / speed
            } else {
                Vector3::zeros()
            },
            rate,
            slower: 1.0 + rate * speed * time,
            log_slopes: atmosphere.log_slopes(&state.position),
            turning: atmosphere.wind_gradient(),
        }
    }

    /// `∂γ⁺/∂[x, γ]`, from `∂f/∂w = I/d − (κ t/d²) w wᵀ/s` and `∂f/∂x = −(κ s t/d²) w (∇ ln κ)ᵀ`.
    fn gradient(&self) -> [Matrix3<f64>; 2] {
        let per = self.slower.recip();
        let braked = self.rate * self.time * per * per;
        let by_velocity = self.by_velocity();
        let by_position = -braked * self.speed * self.relative * self.log_slopes.0.transpose();
        let moving = self.turning - by_velocity * self.turning + by_position;
        [self.mass * moving, by_velocity]
    }

    /// `∂f/∂w`
    fn by_velocity(&self) -> Matrix3<f64> {
        let per = self.slower.recip();
        let braked = self.rate * self.time * per * per;
        Matrix3::from_diagonal_element(per) - braked * self.relative * self.direction.transpose()
    }

    /// `ω · ∂γ⁺/∂ω`, `m (I − ∂f/∂w) S(ω) (x − c)`.
    fn by_rotation(&self) -> Vector3<f64> {
        self.mass * (self.wind - self.by_velocity() * self.wind)
    }

    /// `∂γ⁺/∂(ln κ)`, `−m (κ s t/d²) w`.
    fn by_density(&self) -> Vector3<f64> {
        let per = self.slower.recip();
        (-self.mass * self.rate * self.time * self.speed * per * per) * self.relative
    }

    /// Second derivatives of `λ · γ⁺` by `[x, γ]`.
    fn curvature(&self, lambda: &Vector3<f64>) -> Blocks {
        let (w, s) = (&self.relative, self.speed);
        let n = &self.direction;
        let per = self.slower.recip();
        // κ t/d, and λ · w.
        let braked = self.rate * self.time * per;
        let along = lambda.dot(w);
        let outer = lambda * n.transpose();
        let across = Matrix3::identity() - n * n.transpose();
        let share = lambda.dot(n);
        let by_velocities = per
            * braked
            * ((2.0 * braked * along) * n * n.transpose()
                - (outer + outer.transpose())
                - share * across);
        let (slope, log_curvature) = &self.log_slopes;
        // By the velocity and the logarithm of κ.
        let by_both = per * braked * (2.0 * braked * s * along * n - s * lambda - along * n);
        let by_log = -per * braked * s * along;
        let by_logs = by_log * (1.0 - 2.0 * braked * s);
        let by_positions = by_logs * slope * slope.transpose() + by_log * log_curvature;
        let mixed = slope * by_both.transpose();
        let turned = mixed * self.turning;
        let position_position = by_positions - turned - turned.transpose()
            + self.turning.transpose() * by_velocities * self.turning;
        let position_momentum = mixed - self.turning.transpose() * by_velocities;
        [
            [self.mass * position_position, position_momentum],
            [position_momentum.transpose(), by_velocities / self.mass],
        ]
    }
}

/// The free motion of a center of mass over a time: half of the drag, the displacement, and half of the drag.
pub struct GlideDerivatives {
    per_mass: f64,
    halves: [Slowing; 2],
}

impl RigidBody {
    /// The derivatives of [`glide`](Self::glide) from this state, if the body has drag.
    pub fn glide_derivatives(
        &self,
        state: &BodyState,
        time: f64,
        factor: f64,
    ) -> Option<GlideDerivatives> {
        let drag = self.drag()?;
        let per_mass = time / self.mass;
        let mut state = *state;
        let half = [0.5 * time, factor];
        let first = Slowing::new(drag, self.mass, &state, half);
        drag.slow(self.mass, &mut state, 0.5 * time, factor);
        state.position += per_mass * state.linear_momentum;
        let second = Slowing::new(drag, self.mass, &state, half);
        Some(GlideDerivatives {
            per_mass,
            halves: [first, second],
        })
    }
}

impl GlideDerivatives {
    /// First derivatives of `[x, γ]` between the halves by those at the beginning.
    fn between(&self) -> Blocks {
        let by = self.halves[0].gradient();
        let [by_position, by_momentum] = by;
        let place = [
            Matrix3::identity() + self.per_mass * by_position,
            self.per_mass * by_momentum,
        ];
        [place, by]
    }

    /// First derivatives of `[x, γ]` at the end by those at the beginning.
    pub fn gradient(&self) -> Blocks {
        let [place, between] = self.between();
        let [by_position, by_momentum] = self.halves[1].gradient();
        let later = [0, 1].map(|by| by_position * place[by] + by_momentum * between[by]);
        [place, later]
    }

    /// First derivatives of `[x, γ]` at the end by the logarithm of the density of the air.
    pub fn by_density(&self) -> [Vector3<f64>; 2] {
        self.after(self.halves.each_ref().map(Slowing::by_density))
    }

    /// First derivatives of `[x, γ]` at the end by a factor of the angular velocity of the air.
    pub fn by_rotation(&self) -> [Vector3<f64>; 2] {
        self.after(self.halves.each_ref().map(Slowing::by_rotation))
    }

    /// The changes of `[x, γ]` at the end for changes of the momentum in each half.
    fn after(&self, [first, second]: [Vector3<f64>; 2]) -> [Vector3<f64>; 2] {
        let [by_position, by_momentum] = self.halves[1].gradient();
        let position = self.per_mass * first;
        [
            position,
            by_position * position + by_momentum * first + second,
        ]
    }

    /// Second derivatives of `λ · [x, γ]` at the end by `[x, γ]` at the beginning.
    pub fn curvature(&self, lambda: &[Vector3<f64>; 2]) -> Blocks {
        let [first, second] = &self.halves;
        let between = self.between();
        let [by_place, by_between] = second.gradient();
        let later = second.curvature(&lambda[1]);
        // The multiplier of the momentum between the halves.
        let of_place = lambda[0] + by_place.tr_mul(&lambda[1]);
        let of_momentum = self.per_mass * of_place + by_between.tr_mul(&lambda[1]);
        let mut all = first.curvature(&of_momentum);
        for (i, row) in all.iter_mut().enumerate() {
            for (j, block) in row.iter_mut().enumerate() {
                for (k, later) in later.iter().enumerate() {
                    for (l, later) in later.iter().enumerate() {
                        *block += between[k][i].tr_mul(later) * between[l][j];
                    }
                }
            }
        }
        all
    }
}
