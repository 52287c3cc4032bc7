//! What an automatic integrator has chosen, kept with the scene so that nothing has to choose it again.

use std::fmt;
use std::ops::ControlFlow;

use lgvi_dynamics::auto::{Choice, ChoiceError, Run, choose};
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{Method, System};
use serde::Deserialize;

use crate::integrator::IntegratorFile;
use crate::{Integration, Scene, SceneError};

/// What flies a scene whose integrator is automatic.
#[derive(Clone, Debug, PartialEq)]
pub struct Chosen {
    /// The method.
    pub method: Method,
    /// Steps of the method in each step of the run.
    pub substeps: u32,
    /// What is not as asked, or not known to be.
    pub warning: Option<String>,
}

/// `chosen = { integrator = { name = "nystrom", order = 8 }, substeps = 4 }`, which a flight's scene begins with.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ChosenFile {
    integrator: IntegratorFile,
    substeps: u32,
    warning: Option<String>,
}

impl Chosen {
    /// From the file, for a scene with this integrator.
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
    /// As the scene's key has it.
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
            Method::Nystrom { order } => write!(f, "{{ name = \"nystrom\", order = {order} }}")?,
            Method::Lgvi(Rotor::Discrete) => write!(f, "\"lgvi\"")?,
            // Not among the candidates.
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
    /// The accuracy that a method and substeps are to be chosen for; none where they are known.
    pub fn undecided(&self) -> Option<f64> {
        match self.integration {
            Integration::Auto { tolerance } if self.chosen.is_none() => Some(tolerance),
            _ => None,
        }
    }

    /// Method and substeps that reach this accuracy at the least predicted cost, and why. The same on every machine.
    /// `progress` is told about which part is done, some times a second, and may end the search.
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

    /// The same with what was chosen, as [`Chosen`] writes it, also in its text.
    pub fn decided(&self, chosen: &str) -> Result<Self, SceneError> {
        let text = format!("chosen = {chosen}\n{}", self.text);
        Self::parse(&self.name, &text)
    }
}
