"""Functions of rows as functions of arrays with any leading dimensions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats: TypeAlias = NDArray[np.float64]


def apply(
    function: Callable[[Any], Floats],
    name: str,
    value: ArrayLike,
    shape: tuple[int, ...],
    result: tuple[int, ...],
) -> Floats:
    """Apply a function from rows of `shape` to rows of `result`."""
    array, leading = _split(name, value, shape)
    rows = array.reshape(_count(leading), _count(shape))
    return function(rows).reshape(leading + result)


def apply_to_pairs(
    function: Callable[[Any, Any], Floats],
    one: tuple[str, ArrayLike, tuple[int, ...]],
    other: tuple[str, ArrayLike, tuple[int, ...]],
    result: tuple[int, ...],
) -> Floats:
    """Apply a function of two rows; leading dimensions are broadcast against each other."""
    (a, leading_a), (b, leading_b) = _split(*one), _split(*other)
    leading = np.broadcast_shapes(leading_a, leading_b)
    count = _count(leading)
    rows_a = np.broadcast_to(a, leading + one[2]).reshape(count, _count(one[2]))
    rows_b = np.broadcast_to(b, leading + other[2]).reshape(count, _count(other[2]))
    return function(rows_a, rows_b).reshape(leading + result)


def numbers(name: str, value: ArrayLike) -> NDArray[Any]:
    """An array of real numbers, as it is."""
    array = np.asarray(value)
    if array.dtype.kind not in "biuf":
        raise TypeError(f"`{name}` has the type {array.dtype}, expected real numbers")
    return array


def _split(name: str, value: ArrayLike, shape: tuple[int, ...]) -> tuple[Floats, tuple[int, ...]]:
    array = np.require(numbers(name, value), float, ["ALIGNED", "C_CONTIGUOUS"])
    leading = array.shape[: max(array.ndim - len(shape), 0)]
    if array.shape != leading + shape:
        expected = ", ".join(map(str, shape))
        raise ValueError(f"`{name}` has the shape {array.shape}, expected (..., {expected})")
    return array, leading


def _count(shape: tuple[int, ...]) -> int:
    return int(np.prod(shape, dtype=int))
