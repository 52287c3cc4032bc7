"""Controls that are flown as they are given."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.typing import ArrayLike


@dataclass(frozen=True)
class Controls:
    """Forces and moments on a body, or torques of its reaction wheels, each held over an interval.

    Parameters
    ----------
    force_n, moment_n_m : array_like, shape (k, 3)
        Force at the center of mass (N) and moment about it (N m, body frame) in each interval. One of them may be left out.
    wheel_torque_n_m : array_like, shape (k, wheels)
        Torques of the motors of the body's wheels (N m), instead of force and moment.
    body : str
        Name of the body; may be left out if the scene has a single one.
    first_step : int
        The step at which the first interval starts.
    hold_steps : int
        Steps that an interval lasts.
    frame : {"inertial", "body"}
        Axes of the force. In those of the body it turns with it, from one step to the next.

    Examples
    --------
    >>> import lgvi
    >>> scene = lgvi.rigid_bodies(2.0, [1.0, 2.0, 3.0], duration_s=1.0, steps=10)
    >>> push = lgvi.Controls(force_n=[[4.0, 0.0, 0.0]], hold_steps=10)
    >>> flight = scene.fly(controls=push)
    >>> print(flight.velocity_m_s[-1, 0].round(12))
    [2. 0. 0.]
    """

    force_n: ArrayLike | None = None
    moment_n_m: ArrayLike | None = None
    wheel_torque_n_m: ArrayLike | None = None
    body: str | None = None
    first_step: int = 0
    hold_steps: int = 1
    frame: str = "inertial"
