"""What tests share."""

from __future__ import annotations

from pathlib import Path

import pytest

import lgvi

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def root() -> Path:
    """The repository."""
    return ROOT


@pytest.fixture(scope="session")
def scenes() -> Path:
    """The directory of scene files."""
    return ROOT / "scenes"


@pytest.fixture(scope="session")
def bags() -> Path:
    """The directory of bags that nodes have recorded."""
    return ROOT / "bags"


@pytest.fixture(scope="session")
def spin() -> lgvi.Scene:
    """A free body that turns."""
    return lgvi.rigid_bodies(
        2.0, [1.0, 2.0, 3.0], angular_velocity_rad_s=[0.1, 1.0, 0.1], duration_s=10.0, steps=100
    )


@pytest.fixture(scope="session")
def inclination(scenes: Path) -> lgvi.Scene:
    """A change of inclination, with a maneuver."""
    return lgvi.Scene.load(scenes / "inclination_change.toml")


