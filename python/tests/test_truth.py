"""Flights beside reference trajectories of independent methods in extended precision."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lgvi


def truth(root: Path, name: str) -> dict[str, Any]:
    case: dict[str, Any] = json.loads((root / "tests" / "truth" / f"{name}.json").read_text())
    return case


def scene_of(case: dict[str, Any], duration: float, steps: int, integrator: Any) -> lgvi.Scene:
    gravity: dict[str, Any] = {
        "none": {},
        "points": {"mutual": {"constant": case["parameters"]["G"]}},
        "macc2": {"mutual": {"constant": case["parameters"]["G"]}},
        "central": {"central": {"gm": case["parameters"].get("GM", 0.0)}},
    }[case["potential"]]
    bodies = []
    for index, body in enumerate(case["bodies"]):
        entry = {
            "name": f"body{index}",
            "mass": body["mass"],
            "inertia": body["J"],
            "position": body["x"],
            "velocity": body["v"],
            "attitude": body["R"],
            "angular_velocity": body["Omega"],
            "points": [{"mass": m, "position": rho} for m, *rho in body["points"]],
        }
        if case["potential"] == "macc2":
            entry["multipole"] = {"order": 2}
        bodies.append(entry)
    run = {"duration": duration, "steps": steps, "integrator": integrator}
    return lgvi.Scene.from_dict({"title": case["case"], "run": run, "gravity": gravity, "bodies": bodies})


@pytest.mark.parametrize(
    ("name", "until", "steps", "integrator", "bounds"),
    [
        # Bounds of position (relative to the size of the scene), and of attitude.
        ("a1_two_dumbbells_regular", 30.0, 6000, {"name": "nystrom", "order": 8}, (1e-11, 1e-10)),
        ("b2_dzhanibekov", 100.0, 100, "closed_form", (0.0, 1e-11)),
        ("g_kepler", 100.0, 1000, {"name": "taylor", "tolerance": 1e-15}, (1e-11, 1e-14)),
        ("e_kw4_like", 432000.0, 2000, {"name": "nystrom", "order": 8}, (1e-10, 1e-9)),
    ],
)
def test_references_are_met(
    root: Path, name: str, until: float, steps: int, integrator: Any, bounds: tuple[float, float]
) -> None:
    case = truth(root, name)
    references = [state for state in case["states"] if state["t"] <= until]
    assert len(references) >= 3
    flight = scene_of(case, until, steps, integrator).fly(t_eval=[state["t"] for state in references])
    expected = np.array([state["y"] for state in references]).reshape(len(references), -1, 18)
    size = max(np.abs(expected[..., :3]).max(), 1e-300)
    assert np.abs(flight.position_m - expected[..., :3]).max() <= bounds[0] * size
    rotation = expected[..., 6:15].reshape(*expected.shape[:2], 3, 3)
    assert np.abs(flight.rotation - rotation).max() <= bounds[1]
    rate = np.abs(expected[..., 15:]).max()
    assert np.abs(flight.angular_velocity_rad_s - expected[..., 15:]).max() <= 10 * bounds[1] * rate + 1e-300
    speed = max(np.abs(expected[..., 3:6]).max(), 1e-300)
    assert np.abs(flight.velocity_m_s - expected[..., 3:6]).max() <= 10 * bounds[0] * speed


def test_observed_order_between_steps_is_that_of_the_method(root: Path) -> None:
    """A time between two steps is reached with the order of the method."""
    case = truth(root, "a1_two_dumbbells_regular")
    reference = np.array(case["states"][0]["y"]).reshape(-1, 18)
    errors = []
    for steps in (250, 500):
        # t = 1 is a third of a step behind the one before it.
        duration = steps / (steps - 2 / 3)
        scene = scene_of(case, duration, steps, {"name": "nystrom", "order": 4})
        flight = scene.fly(t_eval=[1.0])
        assert flight.state(0).step is None
        errors.append(np.abs(flight.position_m[0] - reference[:, :3]).max())
    assert 3.5 < np.log2(errors[0] / errors[1]) < 4.7
