//! The extension module of the Python package `lgvi`.

mod actuators;
mod arrays;
mod bag;
mod controls;
mod dataset;
mod ensemble;
mod error;
mod flight;
mod force;
mod gravity;
mod lie;
mod plan;
mod scene;
mod simulation;
mod state;
mod sweep;
mod toml_value;
mod trajectory;
mod watch;
mod wheels;

use pyo3::prelude::*;

#[pymodule]
mod _lgvi {
    #[pymodule_export]
    use crate::bag::Bag;
    #[pymodule_export]
    use crate::lie::{
        se3_act, se3_adjoint, se3_compose, se3_exp, se3_inverse, se3_left_jacobian, se3_log,
        so3_exp, so3_from_quaternion, so3_left_jacobian, so3_log, so3_to_quaternion,
    };
    #[pymodule_export]
    use crate::plan::Plan;
    #[pymodule_export]
    use crate::scene::Scene;
    #[pymodule_export]
    use crate::simulation::Simulation;
    #[pymodule_export]
    use crate::state::State;
    #[pymodule_export]
    use crate::trajectory::Trajectory;

    use super::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
