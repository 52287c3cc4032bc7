"""Rigid bodies in space: Lie group variational integrators, optimal control and Monte Carlo.

Quantities are in SI, and names of arrays end with their units. Positions, velocities, linear momenta and forces are in the
inertial frame of the scene; angular velocities, moments and inertia are in the body frame. Attitudes are from the body frame
to the inertial one.

Examples
--------
>>> import lgvi
>>> scene = lgvi.rigid_bodies(
...     1.0, [1.0, 2.0, 3.0], position_m=[1.0, 0.0, 0.0], velocity_m_s=[0.0, 1.0, 0.0],
...     gravity={"central": {"gm": 1.0}}, duration_s=6.283185307179586, steps=1000,
...     integrator={"name": "nystrom", "order": 6},
... )
>>> flight = scene.fly()
>>> print(flight.position_m[-1, 0].round(9))
[1. 0. 0.]
"""

from lgvi import se3, so3
from lgvi._lgvi import Bag, Plan, Scene, Simulation, State, Trajectory, __version__
from lgvi.bodies import rigid_bodies
from lgvi.controls import Controls
from lgvi.errors import (
    BagError,
    ControlError,
    EnsembleError,
    FlightError,
    LgviError,
    PlanError,
    RotationError,
    SceneError,
)
from lgvi.results import Explanation, Table

__all__ = [
    "Bag",
    "BagError",
    "ControlError",
    "Controls",
    "EnsembleError",
    "Explanation",
    "FlightError",
    "LgviError",
    "Plan",
    "PlanError",
    "RotationError",
    "Scene",
    "SceneError",
    "Simulation",
    "State",
    "Table",
    "Trajectory",
    "__version__",
    "rigid_bodies",
    "se3",
    "so3",
]
