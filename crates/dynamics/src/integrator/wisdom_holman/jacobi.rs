use nalgebra::Vector3;

use super::kepler;
use crate::{BodyState, Load, RigidBody, StepError};

/// Kepler's motion of free bodies in Jacobi coordinates: each about the center of mass of those before it.
///
/// With the heaviest body first and then by distance from it, `η_i = m_0 + … + m_i`, `R_i` the center of mass of the
/// first i + 1 bodies, and `r_i = x_i − R_{i−1}`, the kinetic energy is `|P|²/2M + Σ μ_i |ṙ_i|²/2` with
/// `μ_i = m_i η_{i−1}/η_i`, and `A = |P|²/2M + Σ (μ_i |ṙ_i|²/2 − G m_i η_{i−1}/|r_i|)`: the center of mass moves
/// uniformly, and each `r_i` in the field of `GM = G η_i`.
pub(super) struct Jacobi {
    constant: f64,
    /// The bodies from the inside out.
    links: Vec<Link>,
}

/// A body with those inside it.
struct Link {
    /// Its index.
    body: usize,
    /// Its mass `m_i`.
    mass: f64,
    /// `η_{i−1}`, `η_i` and `m_i/η_i`.
    inside: f64,
    total: f64,
    share: f64,
    /// `G m_i η_{i−1}`.
    strength: f64,
    /// Distance from the first body at the start, by which they are ordered.
    distance: f64,
    /// The change of `r_i` and `ṙ_i` in a drift, or the force on `r_i` in a kick.
    change: [Vector3<f64>; 2],
}

impl Jacobi {
    /// The coordinates of `free` bodies (indices, at least two) under the gravitational constant.
    pub(super) fn new(constant: f64, bodies: &[RigidBody], free: &[usize]) -> Self {
        let links = free.iter().map(|&body| Link {
            body,
            mass: bodies[body].mass(),
            inside: 0.0,
            total: 0.0,
            share: 0.0,
            strength: 0.0,
            distance: 0.0,
            change: [Vector3::zeros(); 2],
        });
        Self {
            constant,
            links: links.collect(),
        }
    }

    /// The first body.
    pub(super) fn center(&self) -> usize {
        self.links[0].body
    }

    /// Orders the bodies.
    pub(super) fn order(&mut self, states: &[BodyState]) {
        let heavier = |one: &Link, other: &Link| other.mass.total_cmp(&one.mass);
        self.links
            .sort_unstable_by(|one, other| heavier(one, other).then(one.body.cmp(&other.body)));
        let center = states[self.center()].position;
        for link in &mut self.links {
            link.distance = (states[link.body].position - center).norm();
        }
        self.links[1..].sort_unstable_by(|one, other| {
            let nearer = one.distance.total_cmp(&other.distance);
            nearer.then(one.body.cmp(&other.body))
        });
        let mut inside: f64 = 0.0;
        for link in &mut self.links {
            link.inside = inside;
            link.strength = self.constant * link.mass * inside;
            link.total = inside + link.mass;
            link.share = link.mass / link.total;
            inside = link.total;
        }
    }

    /// Moves the bodies by `h`.
    ///
    /// Only changes are carried back from the `r_i`: `Δx_i = h P/M + (η_{i−1}/η_i) Δr_i − Σ_{j>i} (m_j/η_j) Δr_j`, so
    /// that rounding is that of the changes, and the first body receives the opposite of all other changes of momentum.
    /// Factors that are rounded, such as `1/m_i` and `η_{i−1}/η_i`, are avoided: their products would not be 1, and energy
    /// would drift with the number of steps.
    #[inline]
    pub(super) fn drift(&mut self, states: &mut [BodyState], h: f64) -> Result<(), StepError> {
        let first = &states[self.center()];
        let mut place = first.position;
        let mut momentum = first.linear_momentum;
        for link in &mut self.links[1..] {
            let state = &states[link.body];
            let r = state.position - place;
            let v = state.linear_momentum / link.mass - momentum / link.inside;
            link.change = kepler::advance(self.constant * link.total, &r, &v, h)
                .map_err(|obstacle| obstacle.on(link.body))?;
            place += link.share * r;
            momentum += state.linear_momentum;
        }
        let total = self.links[self.links.len() - 1].total;
        let carried = (h / total) * momentum;
        let mut outside = [Vector3::zeros(); 2];
        let mut given = Vector3::zeros();
        for link in self.links[1..].iter().rev() {
            let [moved, turned] = link.change;
            let shared = [link.share * moved, link.share * turned];
            let state = &mut states[link.body];
            state.position += carried + (moved - shared[0] - outside[0]);
            let impulse = link.mass * (turned - shared[1] - outside[1]);
            state.linear_momentum += impulse;
            given += impulse;
            outside[0] += shared[0];
            outside[1] += shared[1];
        }
        let first = &mut states[self.links[0].body];
        first.position += carried - outside[0];
        first.linear_momentum -= given;
        Ok(())
    }

    /// Subtracts the attractions of A from the loads: with the force `g_i = −G m_i η_{i−1} r_i/|r_i|³` on each `r_i`,
    /// body i feels `g_i − m_i Σ_{j>i} g_j/η_{j−1}`.
    #[inline]
    pub(super) fn subtract(&mut self, states: &[BodyState], loads: &mut [Load]) {
        let mut place = states[self.center()].position;
        for link in &mut self.links[1..] {
            let r = states[link.body].position - place;
            let squared = r.norm_squared();
            link.change[0] = (link.strength / (squared * squared.sqrt())) * r;
            place += link.share * r;
        }
        let mut outside = Vector3::zeros();
        let mut given = Vector3::zeros();
        for link in self.links[1..].iter().rev() {
            let force = link.change[0] - link.mass * outside;
            loads[link.body].force += force;
            given += force;
            outside += link.change[0] / link.inside;
        }
        loads[self.links[0].body].force -= given;
    }
}
