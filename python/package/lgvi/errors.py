"""Exceptions of lgvi. All of them are `LgviError`."""

from __future__ import annotations


class LgviError(Exception):
    """Base class of lgvi's exceptions."""


class SceneError(LgviError, ValueError):
    """A scene cannot be flown.

    Attributes
    ----------
    file : str or None
        File of the scene, if it came from one.
    line : int or None
        Line of the text, counted from 1, if it is known.
    key : str or None
        Path of the key, such as ``bodies[0].mass``; None where the text is no TOML.
    value : str or None
        The value that was found.
    expected : str or None
        A description of valid values.
    """

    def __init__(
        self,
        message: str,
        file: str | None = None,
        line: int | None = None,
        key: str | None = None,
        value: str | None = None,
        expected: str | None = None,
    ) -> None:
        super().__init__(message)
        self.file = file
        self.line = line
        self.key = key
        self.value = value
        self.expected = expected


class RotationError(LgviError, ValueError):
    """A matrix of an array is no rotation, or a quaternion no unit quaternion; the message says which and why.

    The Frobenius norm of RᵀR − I of a rotation R is at most 1e-4, and its determinant is positive. The norm of a unit quaternion
    is 1 to 1e-4. Functions compute with the nearest rotation.
    """


class FlightError(LgviError, RuntimeError):
    """A step cannot be made.

    Attributes
    ----------
    step : int
        The step, counted from 0.
    time_s : float
        Time at the start of the step (s).
    """

    def __init__(self, message: str, step: int = 0, time_s: float = 0.0) -> None:
        super().__init__(message)
        self.step = step
        self.time_s = time_s

    def __reduce__(self) -> tuple[type[FlightError], tuple[str, int, float]]:
        return type(self), (str(self), self.step, self.time_s)


class ControlError(LgviError, ValueError):
    """Controls cannot be flown: they do not fit the scene, or are not finite."""


class PlanError(LgviError, RuntimeError):
    """A maneuver has no plan.

    Attributes
    ----------
    reason : str
        ``"infeasible"``, ``"not_converged"`` or ``"refused"``.
    """

    def __init__(self, message: str, reason: str = "refused") -> None:
        super().__init__(message)
        self.reason = reason

    def __reduce__(self) -> tuple[type[PlanError], tuple[str, str]]:
        return type(self), (str(self), self.reason)


class EnsembleError(LgviError, ValueError):
    """An ensemble cannot be flown."""


class BagError(LgviError, ValueError):
    """A bag cannot be read, repeated or recovered."""
