//! The motion of a body.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x4};
use lgvi_lie::Quaternion;
use nalgebra::{Matrix3, Vector3};

use super::jet::{Integral, Jet, Lanes, Remainder, changes, cross, jet};
use super::lever::Lever;
use super::places::{Place, Places};
use super::rotation::{Matrix, Rotation};
use super::weight::{Torque, Weight};
use crate::rotation::PrincipalAxes;
use crate::{BodyState, Load, Mobility, RigidBody};

/// Displacement in radii of gyration, or rotation (rad), in a step, whose velocity is the least that counts.
const LEAST_MOTION: f64 = 0.1;

/// The coefficients of a body's motion.
pub(super) struct Body {
    mobility: Mobility,
    mass: f64,
    inverse_mass: f64,
    /// Radius of gyration.
    length: f64,
    moments: Vector3<f64>,
    /// Rotation from the principal axes to the body frame, or `None` if they are the same.
    axes: Option<Matrix3<f64>>,
    position: Jet,
    velocity: Jet,
    /// Of position, velocity and angular velocity.
    remainders: [Remainder; 3],
    rotation: Rotation,
    /// True if the rotation is expanded. Without moments it is known in closed form.
    turns: bool,
    lever: Option<Lever>,
    /// Indices of the body's places.
    places: Vec<usize>,
    /// Force of uniform fields, and that with the one of controls, inertial frame; and moment of controls, in principal
    /// axes.
    weight: Vector3<f64>,
    constant_force: Lanes,
    twist: Lanes,
    /// Moments of uniform fields.
    torques: Vec<Torque>,
    /// Coefficient n of moments, in principal axes.
    pub(super) moment: Lanes,
}

impl Body {
    /// The motion of `body` up to `order`. `matrix` is true if forces depend on its attitude.
    pub(super) fn new(body: &RigidBody, matrix: bool, order: usize) -> Self {
        let PrincipalAxes { moments, axes } = PrincipalAxes::of(body.inertia().matrix());
        let mut rotation = Rotation::new(order, &moments, matrix);
        match body.mobility() {
            Mobility::Free | Mobility::Pivoted => {}
            Mobility::Fixed => rotation.prescribe(&Vector3::zeros(), &Vector3::zeros()),
            Mobility::Driven(drive) => {
                let spin = axes.map_or(drive.spin, |axes| axes.tr_mul(&drive.spin));
                rotation.prescribe(&drive.rate, &spin);
            }
        }
        Self {
            mobility: *body.mobility(),
            mass: body.mass(),
            inverse_mass: 1.0 / body.mass(),
            length: (0.5 * body.inertia().matrix().trace() / body.mass()).sqrt(),
            moments,
            axes,
            position: jet(order),
            velocity: jet(order),
            remainders: Default::default(),
            rotation,
            turns: matrix,
            lever: None,
            places: Vec::new(),
            weight: Vector3::zeros(),
            constant_force: Lanes::default(),
            twist: Lanes::default(),
            torques: Vec::new(),
            moment: Lanes::default(),
        }
    }

    /// Converts a vector from the body frame to the principal axes.
    pub(super) fn in_principal_axes(&self, v: &Vector3<f64>) -> Vector3<f64> {
        self.axes.map_or(*v, |axes| axes.tr_mul(v))
    }

    /// Converts a matrix from the body frame to the principal axes.
    pub(super) fn matrix_in_principal_axes(&self, m: &Matrix3<f64>) -> Matrix3<f64> {
        self.axes.map_or(*m, |axes| axes.transpose() * m * axes)
    }

    /// The attitude, if forces depend on it.
    #[inline(always)]
    pub(super) fn matrix(&self) -> Option<&Matrix> {
        self.rotation.matrix.as_ref()
    }

    /// Adds a uniform field, given in the body frame.
    pub(super) fn add_weight(&mut self, weight: &Weight, order: usize) {
        self.weight += weight.mass * weight.acceleration;
        if weight.first_moment != Vector3::zeros() && !self.mobility.is_given() {
            let first_moment = self.in_principal_axes(&weight.first_moment);
            let weight = Weight {
                first_moment,
                ..*weight
            };
            self.torques.push(Torque::new(&weight, order));
            self.turns = true;
        }
    }

    /// Sets the body's places, given all.
    pub(super) fn set_places(&mut self, own: usize, places: &Places, order: usize) {
        let points = places.all.iter().filter_map(|place| match place {
            Place::Body(body, point) if *body == own => Some(point),
            _ => None,
        });
        self.lever = Lever::new(points, order);
        let indices = places.all.iter().enumerate();
        self.places = indices
            .filter(|(_, place)| matches!(place, Place::Body(body, _) if *body == own))
            .map(|(index, _)| index)
            .collect();
    }

    /// Sets the controls.
    pub(super) fn set_control(&mut self, control: &Load) {
        self.constant_force = Lanes::vector((control.force + self.weight).into());
        self.twist = Lanes::vector(self.in_principal_axes(&control.moment).into());
        let controlled = !self.mobility.is_given() && control.moment != Vector3::zeros();
        self.turns = self.rotation.matrix.is_some() || !self.torques.is_empty() || controlled;
    }

    /// Returns true if its rotation is expanded, otherwise it is free or given.
    pub(super) fn turns(&self) -> bool {
        self.turns
    }

    /// Products per term of a sum, if its rotation is expanded.
    pub(super) fn terms(&self) -> f64 {
        let matrix = if self.matrix().is_some() { 3.0 } else { 0.0 };
        if self.mobility.is_given() {
            return matrix;
        }
        let torques = 2.0 * self.torques.len() as f64;
        4.0 + matrix + torques + self.lever.as_ref().map_or(0.0, Lever::terms)
    }

    /// Begins at a state.
    pub(super) fn begin(&mut self, body: &RigidBody, state: &BodyState) {
        self.remainders = Default::default();
        self.position[0] = Lanes::vector(state.position.into());
        self.velocity[0] = Lanes::vector(state.velocity(body).into());
        let attitude = self
            .axes
            .map_or(state.attitude, |axes| state.attitude * axes);
        let (w, u) = lgvi_lie::to_quaternion(&attitude);
        let momentum = self.in_principal_axes(&state.angular_momentum);
        let omega = momentum.component_div(&self.moments);
        let q = Lanes([w, u.x, u.y, u.z]);
        self.begin_rotation(q, Lanes::vector(omega.into()));
    }

    #[inline(always)]
    fn begin_rotation(&mut self, q: Lanes, omega: Lanes) {
        self.rotation.begin(q, omega);
        for torque in &mut self.torques {
            torque.begin(&self.rotation);
        }
    }

    /// Begins at time t of the expansion, in its unit.
    #[inline(always)]
    pub(super) fn begin_at<S: Simd>(&mut self, simd: S, t: f64) {
        let [x, v, q, omega] = self.changes(simd, t);
        let rotation = &self.rotation;
        let [lost_x, lost_v, lost_omega] = &mut self.remainders;
        self.position[0] = lost_x.add(simd, &self.position[0], x);
        self.velocity[0] = lost_v.add(simd, &self.velocity[0], v);
        let omega = lost_omega.add(simd, &rotation.omega[0], omega);
        let q = rotation.q[0].load(simd) + q;
        self.begin_rotation(q.into(), omega);
    }

    /// Position, velocity, quaternion and angular velocity at time t of the expansion, in its unit.
    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, t: f64) -> [Lanes; 4] {
        let [x, v, q, omega] = self.changes(simd, t);
        let rotation = &self.rotation;
        let [lost_x, lost_v, lost_omega] = &self.remainders;
        [
            lost_x.sum(simd, &self.position[0], x),
            lost_v.sum(simd, &self.velocity[0], v),
            (rotation.q[0].load(simd) + q).into(),
            lost_omega.sum(simd, &rotation.omega[0], omega),
        ]
    }

    /// The changes of position, velocity, quaternion and angular velocity from the beginning to time t of the expansion.
    #[inline(always)]
    fn changes<S: Simd>(&self, simd: S, t: f64) -> [f64x4<S>; 4] {
        let Rotation { q, omega, .. } = &self.rotation;
        if self.turns && self.mobility == Mobility::Free {
            return changes(simd, [&self.position, &self.velocity, q, omega], t);
        }
        let [x, v] = changes(simd, [&self.position, &self.velocity], t);
        let [q, omega] = changes(simd, [q, omega], t);
        [x, v, q, omega]
    }

    /// Sets `state` to that at time t of the expansion, in its unit, but leaves the rotation if it is not expanded.
    #[inline(always)]
    pub(super) fn show<S: Simd>(&self, simd: S, t: f64, state: &mut BodyState) {
        let [x, v, q, omega] = self.at(simd, t);
        state.position = x.three().into();
        state.linear_momentum = self.mass * Vector3::from(v.three());
        if self.turns {
            let [w, x, y, z] = q.0;
            let u = Vector3::new(x, y, z);
            let attitude = Quaternion { w, u }.matrix();
            let momentum = self.moments.component_mul(&Vector3::from(omega.three()));
            state.attitude = self
                .axes
                .map_or(attitude, |axes| attitude * axes.transpose());
            state.angular_momentum = self.axes.map_or(momentum, |axes| axes * momentum);
        }
    }

    /// Sets coefficient n of the attitude, and coefficient n + 1 of the quaternion.
    #[inline(always)]
    pub(super) fn turn<S: Simd>(&mut self, simd: S, n: usize, integral: Integral) {
        self.moment = Lanes::default();
        if self.turns {
            self.rotation.turn(simd, n, integral);
            for torque in &mut self.torques {
                torque.turn(simd, n, integral, &self.rotation);
            }
        }
    }

    /// Coefficient n of the position of a point, given in principal axes.
    #[inline(always)]
    pub(super) fn place<S: Simd>(&self, simd: S, n: usize, point: &Vector3<f64>) -> Lanes {
        match &self.rotation.matrix {
            Some(matrix) => (self.position[n].load(simd) + matrix.times(simd, point)).into(),
            None => self.position[n],
        }
    }

    /// Sets coefficient n + 1 of position, velocity and angular velocity from coefficient n of the forces.
    #[inline(always)]
    pub(super) fn accelerate<S: Simd>(
        &mut self,
        simd: S,
        n: usize,
        integral: Integral,
        places: &Places,
    ) {
        match &self.mobility {
            Mobility::Free => {
                let mut force = f64x4::splat(simd, 0.0);
                for place in &self.places {
                    force += places.force[*place].load(simd);
                }
                if n == 0 {
                    force += self.constant_force.load(simd);
                }
                self.velocity[n + 1] = integral.of(force * self.inverse_mass).into();
                self.position[n + 1] = integral.of(self.velocity[n].load(simd)).into();
            }
            Mobility::Driven(drive) => {
                let mut velocity = cross(simd, &drive.rate, self.position[n].load(simd));
                if n == 0 {
                    let v: [f64; 3] = drive.velocity.into();
                    velocity += Lanes::vector(v).load(simd);
                }
                self.position[n + 1] = integral.of(velocity).into();
                return;
            }
            Mobility::Pivoted => {}
            Mobility::Fixed => return,
        }
        if self.turns {
            let moment = self.moment(simd, n, places);
            self.rotation.accelerate(simd, n, integral, moment);
        }
    }

    /// Coefficient n of the moment in principal axes.
    #[inline(always)]
    fn moment<S: Simd>(&mut self, simd: S, n: usize, places: &Places) -> f64x4<S> {
        let mut sum = self.moment.load(simd);
        if n == 0 {
            sum += self.twist.load(simd);
        }
        if let (Some(lever), Some(matrix)) = (&mut self.lever, &self.rotation.matrix) {
            let points = self
                .places
                .iter()
                .filter_map(|place| match &places.all[*place] {
                    Place::Body(_, point) => Some((point, &places.force[*place])),
                    Place::Fixed(_) => None,
                });
            lever.set(simd, n, points);
            sum += lever.moment(simd, n, matrix);
        }
        for torque in &self.torques {
            sum += torque.moment(simd, n);
        }
        sum
    }

    /// The fastest rate, squared, at which velocities change the body's place and attitude, or accelerations its velocities:
    /// 1 per unit of time if it moves by its distance from the origin or turns by a radian.
    pub(super) fn rate(&self) -> f64 {
        let distance = self.position[0].norm_squared() + self.length * self.length;
        let (v, omega) = (&self.velocity, &self.rotation.omega);
        let moving = v[0].norm_squared() / distance;
        let accelerating = (v[1].norm_squared() / distance).sqrt();
        let turning = omega[0].norm_squared().max(omega[1].norm_squared().sqrt());
        match (&self.mobility, self.turns) {
            (Mobility::Free, true) => moving.max(accelerating).max(turning),
            (Mobility::Free, false) => moving.max(accelerating),
            (Mobility::Pivoted, true) => turning,
            (Mobility::Driven(drive), _) => {
                let turning = drive.rate.norm_squared().max(drive.spin.norm_squared());
                turning.max(drive.velocity.norm_squared() / distance)
            }
            _ => 0.0,
        }
    }

    /// The square of the size of coefficient k, the greatest one of position, attitude and velocities that the body's
    /// mobility allows. Velocities of a tenth of the body's length or of a radian in `time` are the least that count.
    pub(super) fn size(&self, k: usize, time: f64) -> f64 {
        let least = LEAST_MOTION / time;
        let relative =
            |jet: &Jet, least: f64| jet[k].norm_squared() / (jet[0].norm_squared() + least * least);
        let changing = |jet: &Jet, least: f64| {
            if time == f64::INFINITY {
                0.0
            } else {
                relative(jet, least)
            }
        };
        let translation = || {
            let position = relative(&self.position, self.length);
            greater(position, changing(&self.velocity, least * self.length))
        };
        let rotation = || {
            let Rotation { q, omega, .. } = &self.rotation;
            greater(4.0 * q[k].norm_squared(), changing(omega, least))
        };
        match (&self.mobility, self.turns) {
            (Mobility::Free, true) => greater(translation(), rotation()),
            (Mobility::Free, false) => translation(),
            (Mobility::Pivoted, true) => rotation(),
            _ => 0.0,
        }
    }
}

/// The greater one, or NaN if one of them is.
pub(super) fn greater(a: f64, b: f64) -> f64 {
    if a >= b || a.is_nan() { a } else { b }
}
