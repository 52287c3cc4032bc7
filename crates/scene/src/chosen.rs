//! The choice that an automatic integrator has made, stored with the scene so that the search runs only once.

use std::fmt;
use std::ops::ControlFlow;

use lgvi_dynamics::auto::{Choice, ChoiceError, Run, choose};
use lgvi_dynamics::integrator::{KeplerScheme, Rotor};
use lgvi_dynamics::{Method, System};
use serde::Deserialize;

use crate::integrator::IntegratorFile;
use crate::{Integration, Scene, SceneError};

/// The method and substeps chosen for a scene whose integrator is automatic.
#[derive(Clone, Debug, PartialEq)]
pub struct Chosen {
    /// The method.
    pub method: Method,
    /// Steps of the method in each step of the run.
    pub substeps: u32,
    /// Describes how the choice falls short of the requested accuracy, or that its accuracy is not known.
    pub warning: Option<String>,
}

/// The entry `chosen = { integrator = { name = "nystrom", order = 8 }, substeps = 4 }` at the beginning of a flight's
/// scene.
#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct ChosenFile {
    /// The chosen integrator.
    integrator: IntegratorFile,
    /// Steps of the integrator per step of the run.
    substeps: u32,
    /// How the choice falls short of the requested accuracy.
    warning: Option<String>,
}

impl Chosen {
    /// Compiles the file's entry for a scene with this integrator.
    pub(crate) fn compile(
        file: ChosenFile,
        integration: Integration,
        system: &System,
    ) -> Result<Self, SceneError> {
        let refuse = |expected: String| Err(SceneError::value("chosen", &file.warning, expected));
        let Integration::Auto { .. } = integration else {
            return refuse("none: the integrator is not `auto`".into());
        };
        let Integration::Method(method) = file.integrator.integration() else {
            return refuse("the method that was chosen, not `auto`".into());
        };
        if let Err(error) = method.integrator(system) {
            return refuse(format!("a method that can fly the scene: {error}"));
        }
        if file.substeps == 0 {
            return Err(SceneError::value(
                "chosen.substeps",
                0,
                "a whole number > 0",
            ));
        }
        Ok(Self {
            method,
            substeps: file.substeps,
            warning: file.warning,
        })
    }
}

impl From<&Choice> for Chosen {
    fn from(choice: &Choice) -> Self {
        Self {
            method: choice.method,
            substeps: choice.substeps,
            warning: choice.warning(),
        }
    }
}

impl fmt::Display for Chosen {
    /// Writes the value of the scene's `chosen` key.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{{ integrator = ")?;
        match self.method {
            Method::ClosedForm => write!(f, "\"closed_form\"")?,
            Method::DormandPrince853 { tolerance } => {
                write!(
                    f,
                    "{{ name = \"dormand_prince853\", tolerance = {tolerance:e} }}"
                )?;
            }
            Method::Taylor { tolerance } => {
                write!(f, "{{ name = \"taylor\", tolerance = {tolerance:e} }}")?;
            }
            Method::Nystrom { order } => write!(f, "{{ name = \"nystrom\", order = {order} }}")?,
            Method::Composition { order, rotor } => {
                let rotor = match rotor {
                    Rotor::Discrete => "discrete",
                    Rotor::Exact => "exact",
                };
                write!(
                    f,
                    "{{ name = \"composition\", order = {order}, rotor = \"{rotor}\" }}"
                )?;
            }
            Method::WisdomHolman { scheme } => {
                let scheme = match scheme {
                    KeplerScheme::Leapfrog => "leapfrog",
                    KeplerScheme::Aba82 => "aba82",
                    KeplerScheme::Aba864 => "aba864",
                    KeplerScheme::Aba1064 => "aba1064",
                };
                write!(f, "{{ name = \"wisdom_holman\", scheme = \"{scheme}\" }}")?;
            }
            Method::Lgvi(Rotor::Discrete) => write!(f, "\"lgvi\"")?,
            // Never chosen automatically.
            other => write!(f, "\"{other}\"")?,
        }
        write!(f, ", substeps = {}", self.substeps)?;
        if let Some(warning) = &self.warning {
            write!(f, ", warning = {}", toml::Value::from(warning.as_str()))?;
        }
        write!(f, " }}")
    }
}

impl Scene {
    /// The accuracy for which a method and substeps still have to be chosen, or `None` if they are known.
    pub fn undecided(&self) -> Option<f64> {
        match self.integration {
            Integration::Auto { tolerance } if self.chosen.is_none() => Some(tolerance),
            _ => None,
        }
    }

    /// Chooses the method and substeps that reach this accuracy at the least predicted cost, and gives the reason. The
    /// result is the same on every machine. `progress` receives an estimate of the completed fraction several times a
    /// second and can stop the search.
    pub fn choice(
        &self,
        tolerance: f64,
        progress: &mut dyn FnMut(f64) -> ControlFlow<()>,
    ) -> Result<Choice, ChoiceError> {
        let run = Run {
            duration: self.duration,
            steps: self.steps,
        };
        choose(&mut self.system(), &self.states(), run, tolerance, progress)
    }

    /// Returns the scene with this choice, in the form that [`Chosen`] writes, also added to its text.
    pub fn decided(&self, chosen: &str) -> Result<Self, SceneError> {
        let text = format!("chosen = {chosen}\n{}", self.text);
        Self::parse(&self.name, &text)
    }
}
