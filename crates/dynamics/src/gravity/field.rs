//! Fixed sources acting on one body, with first and second derivatives for the planner.

mod multipole;
mod points;

use std::ops::AddAssign;

use nalgebra::{Matrix3, Vector3};

use super::{
    Attractor, Clearance, CloseApproach, Form, Gravity, Interaction, Kept, Level, Monopole,
    Separable,
};
use crate::{BodyState, Load, MassDistribution, RigidBody};

/// Gravity of fixed sources on one body at `x` with attitude `R`.
///
/// Derivatives are with respect to the variations `δx` (inertial frame) and `ζ`, where `δR = R S(ζ)`.
///
/// Every [`Attractor`] whose frame is the inertial one is a field. It acts exactly on point masses, and on a polyhedron
/// through its cloud of points. On a body given by its multipole, the source's monopole acts on the body's multipole,
/// and the rest of the source acts on the center of mass only.
///
/// # Assumptions and limitations
/// For a multipole body, the omitted terms, such as the moment due to a planet's oblateness, are smaller than the
/// moment that is kept, by a factor of order `J₂ (a/r)²`. Model the body by points if they matter.
pub trait Field: Send + Sync {
    /// Force and moment.
    fn load(&self, body: &RigidBody, x: &Vector3<f64>, r: &Matrix3<f64>) -> Load;

    /// The potential `U`.
    fn potential(&self, body: &RigidBody, x: &Vector3<f64>, r: &Matrix3<f64>) -> f64;

    /// First derivatives of force and moment.
    fn gradient(&self, body: &RigidBody, x: &Vector3<f64>, r: &Matrix3<f64>) -> LoadGradient;

    /// Second derivatives of `b·force + c·moment` at fixed `weights` (b is their force, c their moment).
    fn curvature(
        &self,
        body: &RigidBody,
        x: &Vector3<f64>,
        r: &Matrix3<f64>,
        weights: &Load,
    ) -> LoadCurvature;

    /// Checks that a body at `x` is outside the sources.
    fn check_clearance(&self, body: &RigidBody, x: &Vector3<f64>) -> Result<(), Intrusion>;

    /// The parameters of the model, or `None` if it has no such form.
    fn form(&self) -> Option<Form> {
        None
    }

    /// Approximate cost of a load on `body`, in multiples of a point in a central field.
    fn cost(&self, body: &RigidBody) -> f64 {
        body.points().len().max(1) as f64
    }

    /// The source, if the field has exactly one.
    fn attractor(&self) -> Option<&dyn Attractor> {
        None
    }
}

/// A body is inside a source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrusion {
    /// Distance between the origins of the body and the source.
    pub distance: f64,
    /// Sum of their radii.
    pub limit: f64,
}

/// First derivatives of a load: `δforce = F_x δx + F_R ζ`, `δmoment = M_x δx + M_R ζ`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoadGradient {
    /// `F_x`.
    pub force_by_position: Matrix3<f64>,
    /// `F_R`.
    pub force_by_attitude: Matrix3<f64>,
    /// `M_x`.
    pub moment_by_position: Matrix3<f64>,
    /// `M_R`.
    pub moment_by_attitude: Matrix3<f64>,
}

/// Derivatives of `p = F_xᵀ b + M_xᵀ c` and `q = F_Rᵀ b + M_Rᵀ c` at fixed b and c:
/// `δp = H_xx δx + H_xR ζ`, `δq = H_Rx δx + H_RR ζ`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoadCurvature {
    /// `H_xx`, symmetric.
    pub position_position: Matrix3<f64>,
    /// `H_xR = H_Rxᵀ`.
    pub position_attitude: Matrix3<f64>,
    /// `H_RR`. It is not symmetric where `q ≠ 0`, because ζ is a variation in a moving frame.
    pub attitude_attitude: Matrix3<f64>,
}

impl AddAssign for LoadGradient {
    fn add_assign(&mut self, other: Self) {
        self.force_by_position += other.force_by_position;
        self.force_by_attitude += other.force_by_attitude;
        self.moment_by_position += other.moment_by_position;
        self.moment_by_attitude += other.moment_by_attitude;
    }
}

impl AddAssign for LoadCurvature {
    fn add_assign(&mut self, other: Self) {
        self.position_position += other.position_position;
        self.position_attitude += other.position_attitude;
        self.attitude_attitude += other.attitude_attitude;
    }
}

impl<A: Attractor> Field for A {
    fn attractor(&self) -> Option<&dyn Attractor> {
        Some(self)
    }

    fn form(&self) -> Option<Form> {
        Attractor::form(self)
    }

    fn cost(&self, body: &RigidBody) -> f64 {
        let accelerations = match body.distribution() {
            MassDistribution::Multipole(_) => 3.0,
            _ => body.points().len() as f64,
        };
        accelerations * Attractor::cost(self)
    }

    #[inline]
    fn load(&self, body: &RigidBody, x: &Vector3<f64>, r: &Matrix3<f64>) -> Load {
        match body.distribution() {
            MassDistribution::Multipole(own) => multipole::load(self, own, x, r),
            _ => points::load(self, body.points(), x, r),
        }
    }

    fn potential(&self, body: &RigidBody, x: &Vector3<f64>, r: &Matrix3<f64>) -> f64 {
        match body.distribution() {
            MassDistribution::Multipole(own) => multipole::potential(self, own, x, r),
            _ => points::potential(self, body.points(), x, r),
        }
    }

    fn gradient(&self, body: &RigidBody, x: &Vector3<f64>, r: &Matrix3<f64>) -> LoadGradient {
        match body.distribution() {
            MassDistribution::Multipole(own) => multipole::gradient(self, own, x, r),
            _ => points::gradient(self, body.points(), x, r),
        }
    }

    fn curvature(
        &self,
        body: &RigidBody,
        x: &Vector3<f64>,
        r: &Matrix3<f64>,
        weights: &Load,
    ) -> LoadCurvature {
        match body.distribution() {
            MassDistribution::Multipole(own) => multipole::curvature(self, own, x, r, weights),
            _ => points::curvature(self, body.points(), x, r, weights),
        }
    }

    fn check_clearance(&self, body: &RigidBody, x: &Vector3<f64>) -> Result<(), Intrusion> {
        let Some(Monopole {
            position, radius, ..
        }) = self.monopole()
        else {
            return Ok(());
        };
        let limit = radius + body.radius();
        let distance = (x - position).norm();
        if distance < limit {
            return Err(Intrusion { distance, limit });
        }
        Ok(())
    }
}

impl<F: Field> Gravity for F {
    fn form(&self) -> Option<Form> {
        Field::form(self)
    }

    fn center(&self) -> Option<Monopole> {
        self.attractor().and_then(Attractor::monopole)
    }

    fn cost(&self, bodies: &[RigidBody]) -> f64 {
        bodies.iter().map(|body| Field::cost(self, body)).sum()
    }

    fn add_loads(&mut self, bodies: &[RigidBody], states: &[BodyState], loads: &mut [Load]) {
        for ((body, state), load) in bodies.iter().zip(states).zip(loads) {
            *load += self.load(body, &state.position, &state.attitude);
        }
    }

    fn potential(&self, bodies: &[RigidBody], states: &[BodyState]) -> f64 {
        let each = |(body, state): (&RigidBody, &BodyState)| {
            Field::potential(self, body, &state.position, &state.attitude)
        };
        bodies.iter().zip(states).map(each).sum()
    }

    fn separable(&mut self) -> Option<&mut dyn Separable> {
        self.attractor().is_some().then_some(self as _)
    }

    fn clearance(&self) -> Option<&dyn Clearance> {
        Some(self)
    }
}

impl<F: Field> Separable for F {
    fn interactions(&self, bodies: &[RigidBody]) -> Vec<Interaction> {
        let Some(source) = self.attractor() else {
            return Vec::new();
        };
        let each = bodies.iter().enumerate().map(|(index, body)| {
            Interaction::of_source(index, body, source, Field::cost(self, body))
        });
        each.collect()
    }

    fn add_kept_loads(
        &mut self,
        bodies: &[RigidBody],
        states: &[BodyState],
        loads: &mut [Load],
        kept: &[Kept],
    ) {
        for kept in kept {
            let (index, state) = (kept.body, &states[kept.body]);
            match (kept.level, self.attractor()) {
                (Level::Monopole, Some(source)) => {
                    loads[index].force += kept.masses * source.acceleration(&state.position);
                }
                _ => loads[index] += self.load(&bodies[index], &state.position, &state.attitude),
            }
        }
    }
}

impl<F: Field> Clearance for F {
    fn check(&self, bodies: &[RigidBody], states: &[BodyState]) -> Result<(), CloseApproach> {
        for (index, (body, state)) in bodies.iter().zip(states).enumerate() {
            if body.mobility().is_given() {
                continue;
            }
            Field::check_clearance(self, body, &state.position).map_err(|intrusion| {
                CloseApproach {
                    body: index,
                    other: None,
                    distance: intrusion.distance,
                    limit: intrusion.limit,
                }
            })?;
        }
        Ok(())
    }
}
