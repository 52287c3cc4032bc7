//! What an inertial measurement unit would read without errors.
//!
//! Over a period `T`, in which its body turns from `R₀` by the rotation vector `θ = log(R₀ᵀR₁)`, it reads the constant
//! angular velocity and specific force in its axes that make the same increments of attitude and velocity:
//!
//! `ω = θ/T`, `f = J_l(θ)⁻¹ R₀ᵀ Δ/T`,
//!
//! because a constant `f` in turning axes makes `Δ = ∫ R₀ exp(tθ/T) f dt = T R₀ J_l(θ) f`. `Δ` is the increment of the
//! velocity of the point of its mount, less that of gravity at the center of mass `C`. On a body that is free, nothing but
//! loads `F`, drag `D` and thrusters, which change its velocity by `Σ δ`, moves `C` beside gravity, so
//! `Δ = Δ(v − v_C) + Σ (F h/m + ½ (D₀ + D₁) h/m + δ)`, and gravity itself is not needed. Bodies that have docked have one center
//! of mass; their drags are those at their own places. On a body that is held or driven, `Δ = Δv − ½ (g₀ + g₁) T`.

use lgvi_dynamics::docking::Docked;
use lgvi_dynamics::{BodyState, Load, Mobility, RigidBody, System};
use lgvi_lie::{left_jacobian_inverse, log};
use lgvi_scene::{Mount, Scene, Sensor};
use nalgebra::{Matrix3, Vector3};

use super::Truth;
use crate::Flight;

/// A period of an inertial sensor.
pub(super) struct Increments {
    /// Its body, and those that may dock to it, directly or by others.
    members: Vec<usize>,
    /// Those of them that are one body with the first, in the scratch of a search.
    together: Vec<bool>,
    /// The gravity on bodies that are not free, and room for its loads.
    held: Option<(System, Vec<Load>)>,
    period: Option<Period>,
    /// The velocity of each member at the beginning, and its change since then by loads and thrusters.
    velocities: Vec<Vector3<f64>>,
    changes: Vec<Vector3<f64>>,
    /// The acceleration of each member by drag at the last step.
    drags: Vec<Vector3<f64>>,
}

struct Period {
    first_step: u64,
    attitude: Matrix3<f64>,
    /// Of the point of the mount.
    velocity: Vector3<f64>,
    /// The acceleration of gravity on a body that is not free.
    gravity: Vector3<f64>,
}

impl Increments {
    pub(super) fn new(scene: &Scene, body: usize) -> Self {
        let mut members = vec![body];
        let mut next = 0;
        while let Some(&member) = members.get(next) {
            for docking in &scene.docking {
                let pair = docking.ports.map(|port| port.body);
                for other in pair {
                    if pair.contains(&member) && !members.contains(&other) {
                        members.push(other);
                    }
                }
            }
            next += 1;
        }
        let free = *scene.bodies[body].body.mobility() == Mobility::Free;
        Self {
            together: vec![false; scene.bodies.len()],
            held: (!free).then(|| {
                (
                    attracting(scene, body),
                    vec![Load::default(); scene.bodies.len()],
                )
            }),
            period: None,
            velocities: vec![Vector3::zeros(); members.len()],
            changes: vec![Vector3::zeros(); members.len()],
            drags: vec![Vector3::zeros(); members.len()],
            members,
        }
    }

    pub(super) fn is_running(&self) -> bool {
        self.period.is_some()
    }

    pub(super) fn end(&mut self) {
        self.period = None;
    }

    /// Begins a period at the present step.
    pub(super) fn begin(&mut self, flight: &Flight, mount: &Mount) {
        let states = flight.states();
        let bodies = flight.system().bodies();
        for (velocity, &member) in self.velocities.iter_mut().zip(&self.members) {
            *velocity = states[member].velocity(&bodies[member]);
        }
        self.changes.fill(Vector3::zeros());
        for (drag, &member) in self.drags.iter_mut().zip(&self.members) {
            *drag = slowing(&bodies[member], &states[member]);
        }
        self.period = Some(Period {
            first_step: flight.step(),
            attitude: states[self.members[0]].attitude,
            velocity: self.velocity(flight, mount),
            gravity: self.gravity(states),
        });
    }

    /// The flight has made a step of length `h`.
    pub(super) fn add(&mut self, flight: &Flight, h: f64) {
        if self.period.is_none() {
            return;
        }
        let bodies = flight.system().bodies();
        let each = self.changes.iter_mut().zip(&mut self.drags);
        for ((change, drag), &member) in each.zip(&self.members) {
            let body = &bodies[member];
            let mut mass = body.mass();
            if let Some(thrusters) = body.thrusters() {
                *change += thrusters.velocity_change();
                // Loads act when half of what flows out in the step has done so.
                mass += 0.5 * h * thrusters.mass_flow();
            }
            *change += (h / mass) * flight.loads()[member].force;
            let before = std::mem::replace(drag, slowing(body, &flight.states()[member]));
            *change += (0.5 * h) * (before + *drag);
        }
    }

    /// What is read at the end of the period, at the present step, if these dockings hold.
    pub(super) fn mean(
        &mut self,
        scene: &Scene,
        flight: &Flight,
        docked: &[Docked],
        mount: &Mount,
    ) -> Option<Truth> {
        let states = flight.states();
        let (velocity, gravity) = (self.velocity(flight, mount), self.gravity(states));
        let free = self.held.is_none();
        if free {
            self.find_together(scene, docked);
        }
        let period = self.period.as_ref()?;
        let steps = flight.step() - period.first_step;
        if steps == 0 {
            return None;
        }
        let time = steps as f64 * scene.h();
        let mut increment = velocity - period.velocity;
        if free {
            let (mut mass, mut change) = (0.0, Vector3::zeros());
            for (index, &member) in self.members.iter().enumerate() {
                if self.together[member] {
                    let body = &flight.system().bodies()[member];
                    let whole = states[member].velocity(body) - self.velocities[index];
                    mass += body.mass();
                    change += body.mass() * (self.changes[index] - whole);
                }
            }
            increment += change / mass;
        } else {
            increment -= 0.5 * (period.gravity + gravity) * time;
        }
        let turn = log(&period.attitude.tr_mul(&states[self.members[0]].attitude));
        let force = left_jacobian_inverse(&turn) * period.attitude.tr_mul(&increment);
        Some(Truth::Inertial {
            rate: mount.attitude.tr_mul(&turn) / time,
            force: mount.attitude.tr_mul(&force) / time,
            time,
        })
    }

    /// What is read where no period has been flown: the angular velocity, and the specific force of a body that turns
    /// uniformly without loads other than drag. A body that is driven circles in addition.
    pub(super) fn instant(&mut self, scene: &Scene, flight: &Flight, sensor: &Sensor) -> Truth {
        let state = &flight.states()[sensor.body];
        let body = &flight.system().bodies()[sensor.body];
        let rate = state.angular_velocity(body);
        let mut center = slowing(body, state) - self.gravity(flight.states());
        if let Mobility::Driven(drive) = body.mobility() {
            center += drive.rate.cross(&state.velocity(body));
        }
        let mount = &sensor.mount;
        let force = state.attitude.tr_mul(&center) + rate.cross(&rate.cross(&mount.position));
        Truth::Inertial {
            rate: mount.attitude.tr_mul(&rate),
            force: mount.attitude.tr_mul(&force),
            time: sensor.every as f64 * scene.h(),
        }
    }

    /// Of the point of the mount, in the inertial frame.
    fn velocity(&self, flight: &Flight, mount: &Mount) -> Vector3<f64> {
        let body = self.members[0];
        let (state, body) = (&flight.states()[body], &flight.system().bodies()[body]);
        let turning = state.angular_velocity(body).cross(&mount.position);
        state.velocity(body) + state.attitude * turning
    }

    /// The acceleration of gravity at the center of a body that is not free; 0 where it is not needed.
    fn gravity(&mut self, states: &[BodyState]) -> Vector3<f64> {
        let body = self.members[0];
        self.held
            .as_mut()
            .map_or_else(Vector3::zeros, |(system, loads)| {
                system.loads(states, loads);
                loads[body].force / system.bodies()[body].mass()
            })
    }

    /// Finds the bodies that are one with the first by these dockings.
    fn find_together(&mut self, scene: &Scene, docked: &[Docked]) {
        self.together.fill(false);
        self.together[self.members[0]] = true;
        // Each round finds one more at least, or is the last.
        for _ in docked {
            for docked in docked {
                let [one, other] = scene.docking[docked.docking].ports.map(|port| port.body);
                let both = self.together[one] || self.together[other];
                (self.together[one], self.together[other]) = (both, both);
            }
        }
    }
}

/// The acceleration of a body by drag.
fn slowing(body: &RigidBody, state: &BodyState) -> Vector3<f64> {
    body.drag_force(state) / body.mass()
}

/// The scene's system with the gravity on a body that is not free, which other bodies of this kind attract, too.
fn attracting(scene: &Scene, body: usize) -> System {
    let mut system = scene.system();
    let held = &mut system.bodies_mut()[body];
    *held = held.clone().with_mobility(Mobility::Free);
    system
}
