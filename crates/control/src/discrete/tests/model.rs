//! A body in a field and its steps in any arithmetic, from potentials only.

use std::sync::Arc;

use lgvi_dynamics::drag::{Atmosphere, Drag};
use lgvi_dynamics::gravity::{Fixed, Moments, Multipole, Polyhedron, PolyhedronField, Sources};
use lgvi_dynamics::{BodyState, Inertia, PointMass, RigidBody};
use nalgebra::{Matrix3, Vector3};
use num_dual::Dual;

use self::potentials::{
    Cloud, KINDS, Kind, Model, Number, Source, Triple, add, constant, dot, rotated, subtract,
    turned, vector,
};
use crate::problem::Dynamics;
use crate::{Actuation, Transfer};

#[allow(dead_code, reason = "the tests of gravity use more of it")]
#[path = "../../../../dynamics/tests/suite/potentials.rs"]
mod potentials;

const MASS: f64 = 1.7;
const AREA: f64 = 0.6;

/// The arguments of an [`Atmosphere`].
struct Air {
    center: [f64; 3],
    rotation: [f64; 3],
    radius: f64,
    layers: [[f64; 2]; 2],
    scale_height: f64,
}

const AIR: Air = Air {
    center: [0.1, -0.2, 0.05],
    rotation: [0.1, 0.2, -0.3],
    radius: 1.0,
    layers: [[0.0, 2.0], [1.2, 0.5]],
    scale_height: 1.5,
};

pub(crate) fn drag() -> Drag {
    let Air {
        center,
        rotation,
        radius,
        layers,
        scale_height,
    } = AIR;
    let air = Atmosphere::new(
        center.into(),
        rotation.into(),
        radius,
        &layers,
        scale_height,
    );
    Drag::new(Arc::new(air.unwrap()), AREA).unwrap()
}

pub(crate) const H: f64 = 0.13;

pub(crate) fn cross<T: Number>(a: Triple<T>, b: Triple<T>) -> Triple<T> {
    std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j] * b[k] - a[k] * b[j]
    })
}

fn scaled<T: Number>(a: Triple<T>, s: T) -> Triple<T> {
    a.map(|component| component * s)
}

/// A state whose attitude is stored as the three columns of `R`.
#[derive(Clone, Copy)]
pub(crate) struct State<T> {
    pub(crate) x: Triple<T>,
    pub(crate) gamma: Triple<T>,
    pub(crate) r: [Triple<T>; 3],
    pub(crate) pi: Triple<T>,
}

impl<T: Number> State<T> {
    pub(crate) fn of(state: &BodyState) -> Self {
        let column = |i| constant(&state.attitude.column(i).into_owned());
        Self {
            x: constant(&state.position),
            gamma: constant(&state.linear_momentum),
            r: [0, 1, 2].map(column),
            pi: constant(&state.angular_momentum),
        }
    }

    /// `[x + δx, γ + δγ, R exp S(ζ), Π + δΠ]`.
    pub(crate) fn moved(self, z: [T; 12]) -> Self {
        let part = |which: usize| std::array::from_fn(|i| z[3 * which + i]);
        let axis = |i| turned(part(2), constant(&Vector3::ith(i, 1.0)));
        Self {
            x: add(self.x, part(0)),
            gamma: add(self.gamma, part(1)),
            r: [0, 1, 2].map(|i| self.rotated(axis(i))),
            pi: add(self.pi, part(3)),
        }
    }

    /// The state in an arithmetic built on this one.
    pub(crate) fn map<D>(&self, lift: impl Fn(T) -> D + Copy) -> State<D> {
        State {
            x: self.x.map(lift),
            gamma: self.gamma.map(lift),
            r: self.r.map(|column| column.map(lift)),
            pi: self.pi.map(lift),
        }
    }

    /// `R v`.
    pub(crate) fn rotated(&self, v: Triple<T>) -> Triple<T> {
        std::array::from_fn(|i| (0..3).fold(T::from(0.0), |sum, j| sum + self.r[j][i] * v[j]))
    }

    /// `[x, γ, log(R_endᵀ R), Π]` minus the values of `end`; the logarithm is correct to second order.
    pub(crate) fn minus(&self, end: &Self) -> [T; 12] {
        let m = |i: usize, j: usize| dot(end.r[i], self.r[j]);
        let log = [m(2, 1) - m(1, 2), m(0, 2) - m(2, 0), m(1, 0) - m(0, 1)];
        let parts = [
            subtract(self.x, end.x),
            subtract(self.gamma, end.gamma),
            log.map(|twice| twice * 0.5),
            subtract(self.pi, end.pi),
        ];
        std::array::from_fn(|i| parts[i / 3][i % 3])
    }

    /// Solves `h S(Π) = F J_d − J_d Fᵀ` by Newton's method in Cayley form; `R ← R F`, `Π ← Fᵀ Π`.
    pub(crate) fn turn(&mut self, j: &Matrix3<f64>) {
        self.turn_with(j, [T::from(0.0); 3]);
    }

    /// Solves `h S(P) = F J_d − J_d Fᵀ + ½ h S((tr[F] I − Fᵀ) s)`, `P = Π + s`; `R ← R F`, `P ← Fᵀ P`. For `F = cay(f)` it
    /// is `2 (J f + f × J f) + h (f × s − (f·s) f − |f|² s) = h (1 + |f|²) Π`.
    pub(crate) fn turn_with(&mut self, j: &Matrix3<f64>, stored: Triple<T>) {
        let g = scaled(self.pi, T::from(H));
        let s = scaled(stored, T::from(H));
        let zero = T::from(0.0);
        let mut f = [zero; 3];
        for _ in 0..12 {
            let (along, squared) = (dot(s, f), dot(f, f));
            let jf = rotated(j, f);
            let (fjf, fs) = (cross(f, jf), cross(f, s));
            let residual: Triple<T> = std::array::from_fn(|i| {
                let stored = fs[i] - along * f[i] - squared * s[i];
                g[i] * (squared + 1.0) - (jf[i] + fjf[i]) * 2.0 - stored
            });
            let columns: [Triple<T>; 3] = std::array::from_fn(|c| {
                let axis: Triple<T> = constant(&Vector3::ith(c, 1.0));
                let j_axis = rotated(j, axis);
                let (first, second) = (cross(axis, jf), cross(f, j_axis));
                let turned = cross(axis, s);
                std::array::from_fn(|i| {
                    let stored = turned[i] - s[c] * f[i] - along * axis[i] - f[c] * s[i] * 2.0;
                    (j_axis[i] + first[i] + second[i]) * 2.0 + stored - f[c] * g[i] * 2.0
                })
            });
            let [a, b, c] = columns;
            let determinant = dot(a, cross(b, c));
            let solved = [
                dot(residual, cross(b, c)),
                dot(a, cross(residual, c)),
                dot(a, cross(b, residual)),
            ];
            f = std::array::from_fn(|i| f[i] + solved[i] / determinant);
        }
        let factor = (dot(f, f) + 1.0).recip() * 2.0;
        let cayley = |v: Triple<T>, sign: f64| {
            let first = cross(f, v);
            let second = cross(f, first);
            let each = |i: usize| v[i] + factor * (first[i] * sign + second[i]);
            std::array::from_fn(each)
        };
        let columns = [0, 1, 2].map(|i| cayley(constant(&Vector3::ith(i, 1.0)), 1.0));
        self.r = columns.map(|column| self.rotated(column));
        let total = add(self.pi, stored);
        self.pi = subtract(cayley(total, -1.0), stored);
    }
}

/// The attracting sources, each with its potential and its implementation in the library.
enum Attraction {
    One(Source),
    Several(Vec<Source>),
    /// A cuboid with these semi-axes.
    Cuboid([f64; 3]),
}

pub(crate) struct Scene {
    pub(crate) name: String,
    attraction: Attraction,
    cloud: Cloud,
    pub(crate) body: RigidBody,
    pub(crate) state: BodyState,
    actuation: Actuation,
}

/// `−Gσ ∫ dV/r` of a cuboid with `Gσ = 1`, at points outside its slabs, corner by corner (W. D. MacMillan, *The Theory
/// of the Potential*, 1930).
fn cuboid<T: Number>(axes: [f64; 3], d: Triple<T>) -> T {
    let mut sum = T::from(0.0);
    for corner in 0..8 {
        let signs = [0, 1, 2].map(|axis| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 });
        let r: Triple<T> = std::array::from_fn(|i| -d[i] + signs[i] * axes[i]);
        let distance = dot(r, r).sqrt();
        for i in 0..3 {
            let (x, y, z) = (r[i], r[(i + 1) % 3], r[(i + 2) % 3]);
            let along = if x.re() > 0.0 {
                (distance + x).ln()
            } else {
                ((y * y + z * z) / (distance - x)).ln()
            };
            let angle = (y * z / (x * distance)).atan();
            let sign: f64 = signs.iter().product();
            sum += (y * z * along - x * x * angle * 0.5) * sign;
        }
    }
    -sum
}

impl Attraction {
    fn field(&self) -> Sources {
        let one = |source: &Source| source.field();
        Sources::new(match self {
            Self::One(source) => vec![one(source)],
            Self::Several(sources) => sources.iter().map(one).collect(),
            Self::Cuboid(axes) => {
                let body = Polyhedron::cuboid(*axes, 1.0).unwrap();
                vec![Box::new(Fixed::new(
                    PolyhedronField::new(&body, 1.0),
                    Vector3::zeros(),
                    Matrix3::identity(),
                ))]
            }
        })
    }

    /// Potential of a unit mass.
    fn potential<T: Number>(&self, x: Triple<T>) -> T {
        match self {
            Self::One(source) => source.potential(x),
            Self::Several(sources) => {
                let each = sources.iter().map(|source| source.potential(x));
                each.fold(T::from(0.0), |sum, one| sum + one)
            }
            Self::Cuboid(axes) => cuboid(*axes, x),
        }
    }

    fn monopoles(&self) -> Vec<(f64, Vector3<f64>)> {
        let of = |source: &Source| (source.gm, source.position);
        match self {
            Self::One(Source {
                model: Model::Uniform(_),
                ..
            }) => vec![],
            Self::One(source) => vec![of(source)],
            Self::Several(sources) => sources.iter().map(of).collect(),
            Self::Cuboid([a, b, c]) => vec![(8.0 * a * b * c, Vector3::zeros())],
        }
    }
}

impl Scene {
    pub(crate) fn field(&self) -> Sources {
        self.attraction.field()
    }

    pub(crate) fn transfer(&self, dynamics: Dynamics) -> Transfer {
        self.transfer_by(self.actuation.clone())
            .with_dynamics(dynamics)
    }

    /// Three Lie–Euler steps; only the dynamics matter.
    pub(crate) fn transfer_by(&self, actuation: Actuation) -> Transfer {
        let Self { body, state, .. } = self;
        let (body, field) = (body.clone(), self.field());
        Transfer::new(body, field, H, 3, *state, *state, actuation).unwrap()
    }

    /// `U`, with the body's points placed about `x` by `place`.
    fn potential<T: Number>(&self, x: Triple<T>, place: impl Fn(Triple<T>) -> Triple<T>) -> T {
        if let Kind::Series(_) = self.cloud.kind {
            let mut sum = self.attraction.potential(x) * MASS;
            for (gm, position) in self.attraction.monopoles() {
                let e = subtract(constant(&position), x);
                sum -= self.cloud.reach(e, 2, &place) * gm;
            }
            return sum;
        }
        let mut sum = T::from(0.0);
        for point in self.body.points() {
            let arm = place(constant(&point.position));
            sum += self.attraction.potential(add(x, arm)) * point.mass;
        }
        sum
    }

    /// Force and moment: the derivatives of `−U` by x and by a rotation in the body frame.
    pub(crate) fn load<T: Number>(&self, state: &State<T>) -> [T; 6] {
        std::array::from_fn(|axis| {
            let along = |which: usize| -> Triple<Dual<T, f64>> {
                std::array::from_fn(|i| {
                    let part = f64::from(u8::from(axis == 3 * which + i));
                    Dual::new(T::from(0.0), T::from(part))
                })
            };
            let lift = |v: Triple<T>| v.map(Dual::<T, f64>::from_re);
            let columns = state.r.map(lift);
            let x = add(lift(state.x), along(0));
            let u = self.potential(x, |rho| {
                let v = turned(along(1), rho);
                std::array::from_fn(|i| {
                    columns[0][i] * v[0] + columns[1][i] * v[1] + columns[2][i] * v[2]
                })
            });
            -u.eps
        })
    }

    pub(crate) fn kick<T: Number>(&self, state: &mut State<T>, control: [T; 6], tau: f64) {
        let load = self.load(state);
        for i in 0..3 {
            state.gamma[i] += (load[i] + control[i]) * tau;
            state.pi[i] += (load[3 + i] + control[3 + i]) * tau;
        }
    }

    /// `x ← x + (h/m) γ`, between two halves of the drag.
    pub(crate) fn glide<T: Number>(&self, state: &mut State<T>) {
        self.slow(state);
        state.x = add(state.x, scaled(state.gamma, T::from(H / MASS)));
        self.slow(state);
    }

    /// Half of the drag of a step: the velocity relative to the air is divided by `1 + ρ C_D A |v| h/(4m)`.
    fn slow<T: Number>(&self, state: &mut State<T>) {
        if self.body.drag().is_none() {
            return;
        }
        let Air {
            center,
            rotation,
            radius,
            layers,
            scale_height,
        } = AIR;
        let from = subtract(state.x, constant(&center.into()));
        let wind = cross(constant(&rotation.into()), from);
        let altitude = dot(from, from).sqrt() - radius;
        let [[_, dense], [top, thin]] = layers;
        let density = if altitude.re() < top {
            (altitude * ((thin / dense).ln() / top)).exp() * dense
        } else {
            ((altitude - top) * -scale_height.recip()).exp() * thin
        };
        let own = scaled(state.gamma, T::from(MASS.recip()));
        let relative = subtract(own, wind);
        let speed = dot(relative, relative).sqrt();
        let slower = density * speed * (AREA * H / (4.0 * MASS)) + 1.0;
        let slowed = scaled(relative, slower.recip());
        state.gamma = scaled(add(wind, slowed), T::from(MASS));
    }

    /// A step as defined by the equations (4.19)–(4.23), (3.22)–(3.26).
    pub(crate) fn step<T: Number>(
        &self,
        dynamics: Dynamics,
        state: State<T>,
        control: [T; 6],
    ) -> State<T> {
        self.step_by(dynamics, state, |_| control)
    }

    /// A step whose control depends on the state at each kick.
    pub(crate) fn step_by<T: Number>(
        &self,
        dynamics: Dynamics,
        mut state: State<T>,
        control: impl Fn(&State<T>) -> [T; 6],
    ) -> State<T> {
        let [before, after] = scheme(dynamics);
        let load = control(&state);
        self.kick(&mut state, load, before);
        self.glide(&mut state);
        state.turn(self.body.inertia().matrix());
        let load = control(&state);
        self.kick(&mut state, load, after);
        state
    }
}

/// Durations of a scheme's kicks before and after its drift.
pub(crate) fn scheme(dynamics: Dynamics) -> [f64; 2] {
    match dynamics {
        Dynamics::LieEuler => [0.0, H],
        Dynamics::Lgvi => [0.5 * H, 0.5 * H],
    }
}

fn inertia(points: &[PointMass]) -> Inertia {
    let second = Moments::of_points(points).second + Matrix3::from_diagonal_element(0.02);
    Inertia::new(Matrix3::from_diagonal_element(second.trace()) - second).unwrap()
}

/// A body of the given kind and of mass [`MASS`], not aligned with its principal axes.
fn body(cloud: &Cloud) -> RigidBody {
    let inertia = inertia(&cloud.points);
    let multipole = match cloud.kind {
        Kind::Series(2) => {
            let second = Moments::of_points(&cloud.points).second;
            let own = Matrix3::from_diagonal_element(second.trace()) - second;
            Multipole::of_inertia(MASS, &Inertia::new(own).unwrap())
        }
        Kind::Series(_) => Multipole::of_moments(MASS, &Moments::of_points(&cloud.points)),
        Kind::Sphere | Kind::Points => {
            return RigidBody::new(MASS, inertia, cloud.points.clone()).unwrap();
        }
    };
    RigidBody::with_multipole(inertia, multipole).unwrap()
}

fn heavy(kind: Kind, rng: &mut fastrand::Rng, size: f64) -> Cloud {
    let mut cloud = Cloud::random(kind, rng, size);
    cloud.points.iter_mut().for_each(|point| point.mass *= MASS);
    cloud
}

fn rock() -> RigidBody {
    let shape = Polyhedron::ellipsoid([0.3, 0.2, 0.15], 0, 1.0).unwrap();
    let shape = shape.with_mass(MASS).unwrap();
    RigidBody::with_polyhedron(None, &shape.recentered(), 2).unwrap()
}

/// [`scenes`], every second one in air.
pub(crate) fn scenes_in_air(rng: &mut fastrand::Rng) -> Vec<Scene> {
    let mut all = scenes(rng);
    for scene in all.iter_mut().skip(1).step_by(2) {
        scene.body = scene.body.clone().with_drag(drag());
        scene.name.push_str(", in air");
    }
    all
}

/// Every kind of source with every kind of body.
pub(crate) fn scenes(rng: &mut fastrand::Rng) -> Vec<Scene> {
    let mut all = Vec::new();
    let mut bodies: Vec<(Cloud, RigidBody)> = KINDS
        .map(|kind| {
            let cloud = heavy(kind, rng, 0.25);
            let body = body(&cloud);
            (cloud, body)
        })
        .into();
    let rock = rock();
    let points = rock.points().to_vec();
    let kind = Kind::Points;
    bodies.push((Cloud { kind, points }, rock));
    for (index, (cloud, body)) in bodies.into_iter().enumerate() {
        let place = |name, model, rng: &mut fastrand::Rng| Source {
            name,
            model,
            gm: 1.4,
            position: vector(rng, 0.4),
            attitude: lgvi_lie::exp(&vector(rng, 1.8)),
        };
        let oblate = || Model::Oblate {
            j2: 0.1,
            radius: 0.7,
        };
        let series = |order, rng: &mut fastrand::Rng| {
            Model::Series(Cloud::random(Kind::Series(order), rng, 0.4))
        };
        let central = Source {
            position: Vector3::zeros(),
            attitude: Matrix3::identity(),
            ..place("central", Model::Central, rng)
        };
        let (second, fourth) = (series(2, rng), series(4, rng));
        let uniform = Model::Uniform(vector(rng, 1.0));
        let several = vec![
            place("first", Model::Central, rng),
            place("second", oblate(), rng),
            place("third", series(4, rng), rng),
        ];
        let attractions = [
            ("central", Attraction::One(central)),
            ("oblate", Attraction::One(place("oblate", oblate(), rng))),
            ("uniform", Attraction::One(place("uniform", uniform, rng))),
            (
                "second order",
                Attraction::One(place("second", second, rng)),
            ),
            (
                "fourth order",
                Attraction::One(place("fourth", fourth, rng)),
            ),
            ("several", Attraction::Several(several)),
            ("polyhedron", Attraction::Cuboid([0.5, 0.4, 0.3])),
        ];
        for (name, attraction) in attractions {
            let rate = body.inertia().matrix() * vector(rng, 2.0);
            // Two forces, two moments, two of both.
            let columns = [
                [1.0, 0.0],
                [1.0, 0.0],
                [0.0, 1.0],
                [0.0, 1.0],
                [1.0, 1.0],
                [1.0, 1.0],
            ]
            .map(|scale| {
                let column = std::array::from_fn(|i| scale[i / 3] * (rng.f64() - 0.5));
                (column, 1.0 + rng.f64())
            });
            all.push(Scene {
                name: format!("body {index} in {name}"),
                attraction,
                cloud: cloud.clone(),
                body: body.clone(),
                state: BodyState {
                    position: Vector3::new(1.7, 0.8, 0.9) + vector(rng, 0.3),
                    linear_momentum: vector(rng, 1.0),
                    attitude: lgvi_lie::exp(&vector(rng, 1.8)),
                    angular_momentum: rate,
                },
                actuation: Actuation::actuators(&columns).unwrap(),
            });
        }
    }
    all
}
