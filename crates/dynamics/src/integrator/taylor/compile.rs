//! The terms of a system's forces whose Taylor series are computed.

use nalgebra::{Matrix3, Vector3};

use super::body::Body;
use super::multipoles::{Multipoles, Side};
use super::oblate::{Oblate, Source};
use super::places::{Place, Places};
use super::points::{Pair, Pairs};
use super::series::Series;
use super::weight::Weight;
use super::{ExpansionSize, NAME};
use crate::gravity::{Form, Level, Multipole, Placement, SourceShape};
use crate::integrator::MethodError;
use crate::{MassDistribution, PointMass, RigidBody, System};

/// Number of terms that are computed side by side.
const LANES: usize = 4;

/// Greatest number of pairs of points, which keeps the coefficients below half a gigabyte.
const PAIRS: usize = 1 << 18;

/// Returns the series of `system` up to `order`, with coefficients 0.
///
/// # Errors
/// Returns an error if a force has no series here, or if there are too many.
pub(super) fn compile(system: &System, order: usize) -> Result<Series, MethodError> {
    Ok(Terms::of(system)?.series(order))
}

/// Returns the size of the series of `system`.
///
/// # Errors
/// As [`compile`].
pub(super) fn size(system: &System) -> Result<ExpansionSize, MethodError> {
    let terms = Terms::of(system)?;
    let (pairs, oblates) = (terms.pairs.len(), terms.oblates.iter());
    let pairs = pairs.div_ceil(LANES) as f64;
    let oblates = oblates.map(|(_, points)| points.len().div_ceil(LANES));
    let oblates = oblates.sum::<usize>() as f64;
    let (bodies, _) = terms.bodies(1);
    let turning = || bodies.iter().filter(|body| body.turns());
    let sides = terms.multipoles.iter().map(|pole| pole.sides.len());
    let multipoles = sides.map(Multipoles::terms).sum::<f64>();
    Ok(ExpansionSize {
        turning: bodies.iter().map(Body::turns).collect(),
        forces: pairs + oblates + terms.multipoles.len() as f64,
        terms: turning().map(Body::terms).sum::<f64>()
            + Pairs::TERMS * pairs
            + Oblate::TERMS * oblates
            + multipoles,
    })
}

/// The terms, with constants in body frames.
struct Terms<'a> {
    all: &'a [RigidBody],
    /// What represents each body at each level, once it is known.
    matter: Vec<[Option<Matter>; 4]>,
    places: Vec<Place>,
    pairs: Vec<Pair>,
    oblates: Vec<(Source, Vec<(usize, f64)>)>,
    multipoles: Vec<Pole>,
    weights: Vec<(usize, Weight)>,
}

/// Two centers, the product of their strengths, and the aspherical ones of their bodies with what attracts them.
struct Pole {
    centers: [usize; 2],
    strength: f64,
    sides: Vec<(usize, f64, Matrix3<f64>)>,
}

impl<'a> Terms<'a> {
    /// The terms of all gravity that is kept.
    fn of(system: &'a System) -> Result<Self, MethodError> {
        let forms = system.forms().ok_or(MethodError::Model { method: NAME })?;
        let all = system.bodies();
        let mut terms = Self {
            all,
            matter: vec![[const { None }; 4]; all.len()],
            places: Vec::new(),
            pairs: Vec::new(),
            oblates: Vec::new(),
            multipoles: Vec::new(),
            weights: Vec::new(),
        };
        for (index, form) in forms.iter().enumerate() {
            match system.kept(index) {
                Some(kept) => {
                    for kept in kept {
                        terms.add(form, [kept.body, kept.other], kept.level)?;
                    }
                }
                None => terms.add_all(form)?,
            }
        }
        Ok(terms)
    }

    /// Adds all interactions of a gravity model in full.
    fn add_all(&mut self, form: &Form) -> Result<(), MethodError> {
        let mutual = matches!(form, Form::Mutual { .. });
        for body in 0..self.all.len() {
            let others = if mutual {
                body + 1..self.all.len()
            } else {
                body..body + 1
            };
            for other in others {
                let mut both = [body, other].into_iter();
                if !both.all(|body| self.all[body].mobility().is_given()) {
                    self.add(form, [body, other], Level::Full)?;
                }
            }
        }
        Ok(())
    }

    /// Adds the interaction of a body with another one, or with the source if both indices are the same.
    fn add(
        &mut self,
        form: &Form,
        [body, other]: [usize; 2],
        level: Level,
    ) -> Result<(), MethodError> {
        match form {
            Form::Attractor { shape, placement } => {
                self.add_attractor(shape, placement.as_ref(), body, level)
            }
            Form::Uniform { acceleration } => self.add_uniform(acceleration, body, level),
            Form::Mutual { constant } => self.add_mutual(*constant, [body, other], level),
        }
    }

    fn add_attractor(
        &mut self,
        shape: &SourceShape,
        placement: Option<&Placement>,
        body: usize,
        level: Level,
    ) -> Result<(), MethodError> {
        let origin = placement.map_or_else(Vector3::zeros, |placement| placement.position);
        let (gm, second) = match shape {
            SourceShape::Point { gm } => (*gm, None),
            SourceShape::Quadrupole { gm, second } => (*gm, Some(second)),
        };
        let source = self.place(Place::Fixed(origin));
        let matter = self.matter(body, level)?;
        let oblate = |gm: f64, second: &Matrix3<f64>| {
            let attitude = placement.map_or_else(Matrix3::identity, |placement| placement.attitude);
            let (second, axes) = principal(second).ok_or(MethodError::Model { method: NAME })?;
            let attitude = attitude * axes;
            Ok::<_, MethodError>(Source {
                gm,
                second,
                position: origin,
                attitude: (attitude != Matrix3::identity()).then_some(attitude),
            })
        };
        match (second, matter) {
            (None, Matter::Points(points)) => {
                for (place, mass) in points {
                    self.pairs.push(Pair {
                        places: [place, source],
                        strength: gm * mass,
                    });
                }
            }
            (Some(second), Matter::Points(points)) => {
                self.oblates.push((oblate(gm, second)?, points));
            }
            (second, Matter::Multipole(center, own)) => {
                let mass = own.strength();
                let sides = own.second_harmonic().map(|second| (body, gm, *second));
                self.multipoles.push(Pole {
                    centers: [center, source],
                    strength: gm * mass,
                    sides: sides.into_iter().collect(),
                });
                // The rest of the source acts on the center.
                if let Some(second) = second {
                    let rest = oblate(0.0, second)?;
                    self.oblates.push((rest, vec![(center, mass)]));
                }
            }
        }
        Ok(())
    }

    fn add_uniform(
        &mut self,
        acceleration: &Vector3<f64>,
        body: usize,
        level: Level,
    ) -> Result<(), MethodError> {
        let mut weight = Weight {
            acceleration: *acceleration,
            mass: self.all[body].attracted_mass(),
            first_moment: Vector3::zeros(),
        };
        if level > Level::Monopole {
            for PointMass { mass, position } in self.all[body].points() {
                weight.first_moment += *mass * position;
            }
        }
        self.weights.push((body, weight));
        Ok(())
    }

    fn add_mutual(
        &mut self,
        constant: f64,
        pair: [usize; 2],
        level: Level,
    ) -> Result<(), MethodError> {
        let [one, other] = pair;
        match [self.matter(one, level)?, self.matter(other, level)?] {
            [Matter::Points(points), Matter::Points(others)] => {
                let count = self.pairs.len() + points.len() * others.len();
                if count > PAIRS {
                    return Err(MethodError::Parameter {
                        method: NAME,
                        parameter: "number of pairs of points",
                        value: count as f64,
                        expected: "262144 at most",
                    });
                }
                for (place, mass) in points {
                    for (other, other_mass) in &others {
                        self.pairs.push(Pair {
                            places: [place, *other],
                            strength: constant * mass * other_mass,
                        });
                    }
                }
            }
            matter => {
                let [one, other] = [0, 1].map(|own| matter[own].pole(pair[own]));
                let ((center, mass, second), (other_center, other_mass, other_second)) =
                    (one?, other?);
                let sides = [
                    second.map(|second| (pair[0], constant * other_mass, second)),
                    other_second.map(|second| (pair[1], constant * mass, second)),
                ];
                self.multipoles.push(Pole {
                    centers: [center, other_center],
                    strength: constant * mass * other_mass,
                    sides: sides.into_iter().flatten().collect(),
                });
            }
        }
        Ok(())
    }

    /// What represents a body at a level.
    fn matter(&mut self, index: usize, level: Level) -> Result<Matter, MethodError> {
        if let Some(known) = &self.matter[index][level as usize] {
            return Ok(known.clone());
        }
        let body = &self.all[index];
        let center = Place::Body(index, Vector3::zeros());
        let matter = match (level, body.distribution()) {
            (Level::Dropped, _) => Matter::Points(Vec::new()),
            (Level::Monopole, _) => {
                Matter::Points(vec![(self.place(center), body.attracted_mass())])
            }
            (Level::Full, MassDistribution::Points(points)) => {
                let each = points.iter().map(|point| {
                    let place = Place::Body(index, point.position);
                    (self.place(place), point.mass)
                });
                Matter::Points(each.collect())
            }
            (Level::Quadrupole, _) | (Level::Full, MassDistribution::Multipole(_)) => {
                let own = body.to_second_order();
                if own.order() > 2 {
                    return Err(unsupported(index));
                }
                Matter::Multipole(self.place(center), own)
            }
            (Level::Full, MassDistribution::Polyhedron(_)) => return Err(unsupported(index)),
        };
        self.matter[index][level as usize] = Some(matter.clone());
        Ok(matter)
    }

    /// Adds a place and returns its index.
    fn place(&mut self, place: Place) -> usize {
        self.places.push(place);
        self.places.len() - 1
    }

    /// Returns true if forces depend on the attitude of a body.
    fn needs_attitude(&self, index: usize) -> bool {
        let mut places = self.places.iter();
        let mut sides = self.multipoles.iter().flat_map(|pole| &pole.sides);
        places.any(|place| matches!(place, Place::Body(body, point) if *body == index && *point != Vector3::zeros()))
            || sides.any(|(body, ..)| *body == index)
    }

    /// The bodies, and the places in their principal axes.
    fn bodies(&self, order: usize) -> (Vec<Body>, Places) {
        let each = self.all.iter().enumerate();
        let mut bodies: Vec<_> = each
            .map(|(index, body)| Body::new(body, self.needs_attitude(index), order))
            .collect();
        let mut places = Places::default();
        for place in &self.places {
            places.add(match place {
                Place::Fixed(_) => *place,
                Place::Body(body, point) => {
                    Place::Body(*body, bodies[*body].in_principal_axes(point))
                }
            });
        }
        for (index, body) in bodies.iter_mut().enumerate() {
            body.set_places(index, &places, order);
        }
        for (index, weight) in &self.weights {
            bodies[*index].add_weight(weight, order);
        }
        (bodies, places)
    }

    fn series(self, order: usize) -> Series {
        let (bodies, places) = self.bodies(order);
        let multipoles = self.multipoles.iter().map(|pole| {
            let sides = pole.sides.iter().map(|(body, gm, second)| {
                let second = bodies[*body].matrix_in_principal_axes(second);
                Side::new(*body, *gm, &second, order)
            });
            Multipoles::new(pole.centers, pole.strength, sides.collect(), order)
        });
        let multipoles = multipoles.collect();
        let oblates = self.oblates.iter().flat_map(|(source, points)| {
            let chunks = points.chunks(LANES);
            chunks.map(|points| Oblate::new(source.clone(), points, order))
        });
        let pairs = self.pairs.chunks(LANES);
        Series {
            order,
            unit: 1.0,
            oblates: oblates.collect(),
            pairs: pairs.map(|pairs| Pairs::new(pairs, order)).collect(),
            bodies,
            places,
            multipoles,
        }
    }
}

/// What represents a body: points, each a place and its mass, or a multipole at the place of its center.
#[derive(Clone)]
enum Matter {
    Points(Vec<(usize, f64)>),
    Multipole(usize, Multipole),
}

impl Matter {
    /// The place of the center, the mass, and the second moments if there are any.
    fn pole(&self, body: usize) -> Result<(usize, f64, Option<Matrix3<f64>>), MethodError> {
        match self {
            Self::Points(points) => match points[..] {
                [(center, mass)] => Ok((center, mass, None)),
                _ => Err(unsupported(body)),
            },
            Self::Multipole(center, own) => {
                Ok((*center, own.strength(), own.second_harmonic().copied()))
            }
        }
    }
}

fn unsupported(body: usize) -> MethodError {
    MethodError::Body {
        method: NAME,
        body,
        expected: "points that attract points, or multipoles of second order that attract each other and single points",
    }
}

/// The eigenvalues and eigenvectors of a symmetric matrix.
fn principal(matrix: &Matrix3<f64>) -> Option<(Vector3<f64>, Matrix3<f64>)> {
    let diagonal = matrix.diagonal();
    if *matrix == Matrix3::from_diagonal(&diagonal) {
        return Some((diagonal, Matrix3::identity()));
    }
    let eigen = lgvi_lie::symmetric_eigen(matrix)?;
    Some((eigen.eigenvalues, eigen.eigenvectors))
}
