"""Results that are plain Python."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import pandas
    import pyarrow


class Explanation:
    """How a scene is flown, found out without flying it.

    Attributes
    ----------
    data : dict
        All that is known, in SI.
    """

    def __init__(self, text: str, data: str) -> None:
        self._text = text
        self.data: dict[str, Any] = json.loads(data)

    @property
    def warnings(self) -> list[str]:
        """What a user has to know of the scene, a sentence each."""
        return [warning["message"] for warning in self.data["warnings"]]

    def __str__(self) -> str:
        return self._text

    def __repr__(self) -> str:
        return self._text


class Table(Mapping[str, NDArray[Any]]):
    """Columns by name, each a NumPy array with an entry a row.

    Numbers are arrays of their type, texts arrays of `str`, long texts and lists of varying length arrays of objects. pandas and
    pyarrow are used if they are installed; with pyarrow, whatever reads the Arrow PyCapsule interface takes a table as it is.

    Attributes
    ----------
    about : dict
        What the table is of.
    """

    def __init__(self, columns: dict[str, Any], about: dict[str, Any]) -> None:
        self._columns: dict[str, NDArray[Any]] = {name: _array(column) for name, column in columns.items()}
        self.about = about

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self._columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    @property
    def rows(self) -> int:
        """Number of rows."""
        return next((len(column) for column in self._columns.values()), 0)

    def to_pandas(self) -> pandas.DataFrame:
        """The table as a data frame of pandas."""
        import pandas

        return pandas.DataFrame(self._columns)

    def to_arrow(self) -> pyarrow.Table:
        """The table as one of pyarrow. Columns of numbers are not copied."""
        import pyarrow

        columns = {
            name: pyarrow.array(column if column.dtype.kind not in "UO" else column.tolist())
            for name, column in self._columns.items()
        }
        return pyarrow.table(columns)

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        return self.to_arrow().__arrow_c_stream__(requested_schema)

    def __repr__(self) -> str:
        return f"Table({self.rows} rows, columns {', '.join(self._columns)})"


# An array of texts takes four bytes for each character of the longest of them, in each row.
_LONG = 64


def _array(column: Any) -> NDArray[Any]:
    if isinstance(column, np.ndarray):
        return column
    if all(isinstance(cell, str) and len(cell) <= _LONG for cell in column):
        return np.array(column, dtype=np.str_)
    array = np.empty(len(column), dtype=object)
    array[:] = column
    return array
