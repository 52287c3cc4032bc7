//! How a scene names its integrator: by a word, or by a table with a `name` and what else the integrator can be told.

use std::fmt;

use lgvi_dynamics::Method;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::rotation::Chart;
use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

use crate::file::ChartFile;

/// What a scene asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Integration {
    /// This method.
    Method(Method),
}

/// What flies a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scheme {
    /// The method.
    pub method: Method,
    /// Steps of the method in each step of the run.
    pub substeps: u32,
}

impl fmt::Display for Integration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Method(method) => write!(f, "{method}"),
        }
    }
}

/// `integrator = "lgvi"` or `integrator = { name = "nystrom", order = 6 }`.
pub(crate) struct IntegratorFile(Table);

#[derive(Deserialize)]
#[serde(tag = "name", rename_all = "snake_case", deny_unknown_fields)]
enum Table {
    Lgvi {
        rotor: Option<RotorFile>,
    },
    LgviLagrangian {},
    LieEuler {
        rotor: Option<RotorFile>,
    },
    ProcessedLieEuler {
        rotor: Option<RotorFile>,
    },
    Composition {
        order: u32,
        rotor: Option<RotorFile>,
    },
    Nystrom {
        order: u32,
        rotor: Option<RotorFile>,
    },
}

/// `"discrete"`, `"exact"`, or `{ preprocessed = 6 }`.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum RotorFile {
    Discrete,
}

impl IntegratorFile {
    /// What is asked for, the discrete rotor's equation to be solved in `chart`.
    pub(crate) fn integration(&self, chart: ChartFile) -> Integration {
        let chart = match chart {
            ChartFile::Cayley => Chart::Cayley,
            ChartFile::Exponential => Chart::Exponential,
        };
        let rotor = |file: Option<RotorFile>, default: Rotor| match file {
            None => default,
            Some(RotorFile::Discrete) => Rotor::Discrete(chart),
        };
        let discrete = |file| rotor(file, Rotor::Discrete(chart));
        Integration::Method(match self.0 {
            Table::Lgvi { rotor } => Method::Lgvi(discrete(rotor)),
            Table::LgviLagrangian {} => Method::LagrangianLgvi(chart),
            Table::LieEuler { rotor } => Method::LieEuler(discrete(rotor)),
            Table::ProcessedLieEuler { rotor } => Method::ProcessedLieEuler(discrete(rotor)),
            Table::Composition { order, rotor } => Method::Composition {
                order,
                rotor: discrete(rotor),
            },
            Table::Nystrom { order, rotor: file } => Method::Nystrom {
                order,
                rotor: rotor(file, Rotor::Discrete(chart)),
            },
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
