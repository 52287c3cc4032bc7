//! The integrator entry of a scene: a name, or a table with a `name` and the integrator's options.

use std::fmt;

use lgvi_dynamics::integrator::{ChartOrigin, KeplerScheme, Quadrature, Rotor};
use lgvi_dynamics::{Method, Skip};
use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Unexpected, Visitor};
use serde::{Deserialize, Deserializer};

/// The integrator that a scene asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Integration {
    /// A given method.
    Method(Method),
    /// The method and number of substeps that reach an accuracy at the least predicted cost.
    Auto {
        /// Maximum error at the end of the run, as measured by [`Accuracy`](lgvi_dynamics::Accuracy): position errors
        /// relative to the size of the scene, attitude errors in rad.
        tolerance: f64,
    },
}

/// The method that flies a scene, with its options.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scheme {
    /// The method.
    pub method: Method,
    /// Steps of the method in each step of the run.
    pub substeps: u32,
    /// Computations that are skipped.
    pub skip: Skip,
}

/// Computations that a scene allows to be skipped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Skipping {
    /// None.
    Nothing,
    /// Computations that affect the result only by rounding errors.
    Exact,
    /// Also computations that change the end of the run by no more than this, as measured by
    /// [`Accuracy`](lgvi_dynamics::Accuracy).
    Within(f64),
}

/// `skip = "nothing"`, `"exact"`, or `{ tolerance = 1e-9 }`.
#[derive(Clone, Copy)]
pub(crate) enum SkipFile {
    Nothing,
    Exact,
    Tolerance(f64),
}

impl<'de> Deserialize<'de> for SkipFile {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Within {
            tolerance: f64,
        }

        struct Either;

        impl<'de> Visitor<'de> for Either {
            type Value = SkipFile;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("\"nothing\", \"exact\" or a table with a tolerance")
            }

            fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<Self::Value, E> {
                match word {
                    "nothing" => Ok(SkipFile::Nothing),
                    "exact" => Ok(SkipFile::Exact),
                    _ => Err(E::invalid_value(Unexpected::Str(word), &self)),
                }
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                let Within { tolerance } = Within::deserialize(MapAccessDeserializer::new(map))?;
                Ok(SkipFile::Tolerance(tolerance))
            }
        }

        deserializer.deserialize_any(Either)
    }
}

impl fmt::Display for Scheme {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.substeps {
            1 => write!(f, "{}", self.method),
            substeps => write!(f, "{}, {substeps} substeps", self.method),
        }
    }
}

impl fmt::Display for Integration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Method(method) => write!(f, "{method}"),
            Self::Auto { tolerance } => write!(f, "auto to {tolerance:e}"),
        }
    }
}

/// `integrator = "lgvi"` or `integrator = { name = "nystrom", order = 6 }`.
pub(crate) struct IntegratorFile(Table);

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(tag = "name", rename_all = "snake_case", deny_unknown_fields)]
enum Table {
    /// The method and substeps that reach an accuracy at the lowest predicted cost.
    Auto {
        /// Error at the end of the run, 1e-14 to 0.1: relative to the size of the scene, or rad.
        #[serde(default = "auto_tolerance")]
        tolerance: f64,
    },
    /// Lie group variational integrator, second order.
    Lgvi {
        /// Rotation between two kicks: "discrete" by default.
        #[serde(default)]
        rotor: RotorFile,
    },
    /// Lie group variational integrator in Lagrangian form, second order.
    LgviLagrangian {},
    /// Symplectic Lie–Euler method, first order.
    LieEuler {
        /// Rotation between two kicks: "discrete" by default.
        #[serde(default)]
        rotor: RotorFile,
    },
    /// Symmetric composition.
    Composition {
        /// Order: 4, 6, 8 or 10.
        order: u32,
        /// Rotation between two kicks: "discrete" by default.
        #[serde(default)]
        rotor: RotorFile,
    },
    /// Runge–Kutta–Nyström splitting.
    Nystrom {
        /// Order: 4, 6 or 8.
        order: u32,
    },
    /// Wisdom–Holman splitting: Kepler's motion and the exact rotation, kicks by the rest of gravity.
    WisdomHolman {
        /// Coefficients: "aba1064" by default.
        #[serde(default)]
        scheme: KeplerSchemeFile,
    },
    /// Galerkin variational integrator on SE(3).
    Galerkin {
        /// Degree, 1 to 10.
        degree: u32,
        /// Quadrature: "gauss" by default.
        #[serde(default)]
        quadrature: QuadratureFile,
        /// Number of quadrature points; as many as the order needs by default.
        points: Option<u32>,
        /// Origin of the chart: "middle" by default.
        #[serde(default)]
        origin: OriginFile,
    },
    /// Galerkin variational integrator of free bodies.
    EulerPoincare {
        /// Degree, 1 to 10.
        degree: u32,
        /// Quadrature: "gauss" by default.
        #[serde(default)]
        quadrature: QuadratureFile,
        /// Number of quadrature points; as many as the order needs by default.
        points: Option<u32>,
        /// Origin of the chart: "middle" by default.
        #[serde(default)]
        origin: OriginFile,
    },
    /// Exact motion of free bodies.
    ClosedForm {},
    /// Explicit midpoint rule, for comparison.
    ExplicitMidpoint {},
    /// Implicit midpoint rule, for comparison.
    ImplicitMidpoint {},
    /// Crouch–Grossman method, for comparison.
    CrouchGrossman {},
    /// Classical Runge–Kutta method, for comparison.
    RungeKutta4 {},
    /// Fehlberg 7(8) with error control.
    Fehlberg78 {
        /// Error in a step, 1e-17 to 0.1.
        tolerance: f64,
    },
    /// Dormand–Prince 8(5,3) with error control.
    DormandPrince853 {
        /// Error in a step, 1e-17 to 0.1.
        tolerance: f64,
    },
    /// Taylor series with error control.
    Taylor {
        /// Error in a step, 1e-17 to 0.1.
        tolerance: f64,
    },
}

fn auto_tolerance() -> f64 {
    1e-6
}

#[derive(Clone, Copy, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
enum RotorFile {
    #[default]
    /// The discrete rigid-body equations.
    Discrete,
    /// The exact rotation.
    Exact,
}

impl From<RotorFile> for Rotor {
    fn from(file: RotorFile) -> Self {
        match file {
            RotorFile::Discrete => Self::Discrete,
            RotorFile::Exact => Self::Exact,
        }
    }
}

#[derive(Clone, Copy, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
enum KeplerSchemeFile {
    /// Generalized order (2, 2), 1 gravity evaluation per step.
    Leapfrog,
    /// Generalized order (8, 2), 4 gravity evaluations per step.
    Aba82,
    /// Generalized order (8, 6, 4), 7 gravity evaluations per step.
    Aba864,
    /// Generalized order (10, 6, 4), 8 gravity evaluations per step.
    #[default]
    Aba1064,
}

impl From<KeplerSchemeFile> for KeplerScheme {
    fn from(file: KeplerSchemeFile) -> Self {
        match file {
            KeplerSchemeFile::Leapfrog => Self::Leapfrog,
            KeplerSchemeFile::Aba82 => Self::Aba82,
            KeplerSchemeFile::Aba864 => Self::Aba864,
            KeplerSchemeFile::Aba1064 => Self::Aba1064,
        }
    }
}

#[derive(Clone, Copy, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
enum QuadratureFile {
    #[default]
    Gauss,
    Lobatto,
}

impl QuadratureFile {
    /// Returns the rule. The default number of points makes the order twice the degree.
    fn rule(self, degree: u32, points: Option<u32>) -> Quadrature {
        match self {
            Self::Gauss => Quadrature::Gauss(points.unwrap_or(degree)),
            Self::Lobatto => Quadrature::Lobatto(points.unwrap_or(degree.saturating_add(1))),
        }
    }
}

#[derive(Clone, Copy, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
enum OriginFile {
    Start,
    #[default]
    Middle,
}

impl From<OriginFile> for ChartOrigin {
    fn from(file: OriginFile) -> Self {
        match file {
            OriginFile::Start => Self::Start,
            OriginFile::Middle => Self::Middle,
        }
    }
}

impl IntegratorFile {
    /// Returns the requested integration.
    pub(crate) fn integration(&self) -> Integration {
        Integration::Method(match self.0 {
            Table::Auto { tolerance } => return Integration::Auto { tolerance },
            Table::Lgvi { rotor } => Method::Lgvi(rotor.into()),
            Table::LgviLagrangian {} => Method::LagrangianLgvi,
            Table::LieEuler { rotor } => Method::LieEuler(rotor.into()),
            Table::Composition { order, rotor } => Method::Composition {
                order,
                rotor: rotor.into(),
            },
            Table::Nystrom { order } => Method::Nystrom { order },
            Table::WisdomHolman { scheme } => Method::WisdomHolman {
                scheme: scheme.into(),
            },
            Table::Galerkin {
                degree,
                quadrature,
                points,
                origin,
            } => Method::Galerkin {
                degree,
                quadrature: quadrature.rule(degree, points),
                origin: origin.into(),
            },
            Table::EulerPoincare {
                degree,
                quadrature,
                points,
                origin,
            } => Method::EulerPoincare {
                degree,
                quadrature: quadrature.rule(degree, points),
                origin: origin.into(),
            },
            Table::ClosedForm {} => Method::ClosedForm,
            Table::ExplicitMidpoint {} => Method::ExplicitMidpoint,
            Table::ImplicitMidpoint {} => Method::ImplicitMidpoint,
            Table::CrouchGrossman {} => Method::CrouchGrossman,
            Table::RungeKutta4 {} => Method::RungeKutta4,
            Table::Fehlberg78 { tolerance } => Method::Fehlberg78 { tolerance },
            Table::DormandPrince853 { tolerance } => Method::DormandPrince853 { tolerance },
            Table::Taylor { tolerance } => Method::Taylor { tolerance },
        })
    }
}

impl<'de> Deserialize<'de> for IntegratorFile {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;

        impl<'de> Visitor<'de> for Either {
            type Value = IntegratorFile;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the name of an integrator, or a table with its name")
            }

            fn visit_str<E: serde::de::Error>(self, name: &str) -> Result<Self::Value, E> {
                let pairs = std::iter::once(("name", name));
                let map = serde::de::value::MapDeserializer::new(pairs);
                Table::deserialize(map).map(IntegratorFile)
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                Table::deserialize(MapAccessDeserializer::new(map)).map(IntegratorFile)
            }
        }

        deserializer.deserialize_any(Either)
    }
}

#[cfg(test)]
mod schema;
