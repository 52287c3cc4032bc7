"""Scenes from plain arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from lgvi._lgvi import Scene

# No scene has more bodies.
_MOST = 1024


def rigid_bodies(
    mass_kg: ArrayLike,
    inertia_kg_m2: ArrayLike,
    *,
    duration_s: float,
    steps: int,
    position_m: ArrayLike = (0.0, 0.0, 0.0),
    velocity_m_s: ArrayLike = (0.0, 0.0, 0.0),
    attitude_xyzw: ArrayLike = (0.0, 0.0, 0.0, 1.0),
    angular_velocity_rad_s: ArrayLike = (0.0, 0.0, 0.0),
    gravity: Mapping[str, Any] | None = None,
    integrator: str | Mapping[str, Any] = "lgvi",
    names: Sequence[str] | None = None,
) -> Scene:
    """Make a scene of free rigid bodies from plain arrays, in SI.

    Parameters
    ----------
    mass_kg : array_like, shape () or (bodies,)
        Masses (kg).
    inertia_kg_m2 : array_like, shape (3,), (3, 3), (bodies, 3) or (bodies, 3, 3)
        Principal moments of inertia or matrices about the centers of mass (kg m²), body frame. Three numbers for three
        bodies are principal moments that all share; three matrices need the shape (3, 3, 3).
    duration_s : float
        Duration of the run (s).
    steps : int
        Steps of the run.
    position_m, velocity_m_s : array_like, shape (3,) or (bodies, 3)
        Centers of mass (m) and their velocities (m/s), inertial frame.
    attitude_xyzw : array_like, shape (4,) or (bodies, 4)
        Unit quaternions x, y, z, w from the body frame to the inertial one.
    angular_velocity_rad_s : array_like, shape (3,) or (bodies, 3)
        Angular velocities (rad/s), body frame.
    gravity : mapping, optional
        The ``gravity`` table of scene files, such as ``{"central": {"gm": 3.986e14}}`` or ``{"mutual": {"constant": 6.674e-11}}``.
    integrator : str or mapping
        The integrator of scene files, such as ``"lgvi"`` or ``{"name": "nystrom", "order": 6}``.
    names : sequence of str, optional
        Names of the bodies; ``body_0``, ``body_1``, … by default.

    Raises
    ------
    ValueError
        An array has another shape.
    SceneError
        A value cannot be flown.

    Examples
    --------
    >>> import lgvi
    >>> scene = lgvi.rigid_bodies(1.0, [1.0, 2.0, 3.0], angular_velocity_rad_s=[0.1, 1.0, 0.1], duration_s=60.0, steps=600)
    >>> flight = scene.fly()
    >>> flight.angular_velocity_rad_s.shape
    (601, 1, 3)
    >>> drift = abs(flight.angular_momentum_kg_m2_s - flight.angular_momentum_kg_m2_s[0]).max()
    >>> bool(drift < 1e-13)
    True
    """
    masses = np.atleast_1d(np.asarray(mass_kg, dtype=float))
    if masses.ndim != 1:
        raise ValueError(f"`mass_kg` has the shape {masses.shape}, expected () or (bodies,)")
    count = len(masses)
    if count > _MOST:
        raise ValueError(f"`mass_kg` has {count} elements, expected at most {_MOST}")
    inertia = np.asarray(inertia_kg_m2, dtype=float)
    shape = (3, 3) if inertia.ndim == 3 or (inertia.shape == (3, 3) and count != 3) else (3,)
    inertias = _each("inertia_kg_m2", inertia, count, shape)
    positions = _each("position_m", position_m, count, (3,))
    velocities = _each("velocity_m_s", velocity_m_s, count, (3,))
    attitudes = _each("attitude_xyzw", attitude_xyzw, count, (4,))
    rates = _each("angular_velocity_rad_s", angular_velocity_rad_s, count, (3,))
    if names is None:
        names = [f"body_{index}" for index in range(count)]
    if len(names) != count:
        raise ValueError(f"`names` has {len(names)} entries, expected {count}")
    bodies = [
        {
            "name": names[index],
            "mass": masses[index],
            "inertia": inertias[index],
            "position": positions[index],
            "velocity": velocities[index],
            "attitude": dict(zip("xyzw", attitudes[index].tolist(), strict=True)),
            "angular_velocity": rates[index],
        }
        for index in range(count)
    ]
    run = {"duration": float(duration_s), "steps": steps, "integrator": integrator}
    return Scene.from_dict({"title": "Rigid bodies", "run": run, "gravity": gravity, "bodies": bodies})


def _each(name: str, value: ArrayLike, count: int, shape: tuple[int, ...]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return an array of shape (count, *shape)."""
    array = np.asarray(value, dtype=float)
    if array.shape not in (shape, (count, *shape)):
        raise ValueError(f"`{name}` has the shape {array.shape}, expected {shape} or {(count, *shape)}")
    return np.broadcast_to(array, (count, *shape))
