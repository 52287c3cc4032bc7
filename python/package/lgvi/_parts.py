"""Parts of an ensemble, each a Parquet file under a path of fsspec."""

from __future__ import annotations

import hashlib
import io
import json
import os
import re
import uuid
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lgvi.errors import EnsembleError
from lgvi.results import Table

Part: TypeAlias = tuple[int, int]
"""The samples from the first number up to, but not including, the second."""

_NAME = re.compile(r"samples_\d+_\d+\.parquet")

# The entries of `Table.about` that two parts of one ensemble have in common. Files have them as `lgvi.<key>`.
_COMMON = ("identity", "scene", "seed", "samples", "integrator")


def cut(samples: int, part: int) -> list[Part]:
    """Cut the samples into parts that begin at multiples of `part`."""
    return [(first, min(first + part, samples)) for first in range(0, samples, part)]


def file_name(part: Part) -> str:
    """Return the file name of a part, which is that of `lgvi ensemble run`."""
    return f"samples_{part[0]:010}_{part[1]:010}.parquet"


@dataclass(frozen=True)
class Store:
    """A directory of parts, local or in an object store.

    Attributes
    ----------
    path : str
        A path or URL of fsspec.
    options : mapping
        What fsspec needs to open it, such as the endpoint of an object store.
    """

    path: str
    options: Mapping[str, Any] = field(default_factory=dict)

    def files(self) -> set[str]:
        """Return the names of all files of parts that are there."""
        system, root = self._open()
        try:
            paths = system.ls(root, detail=False)
        except FileNotFoundError:
            return set()
        names = {path.rstrip("/").rpartition("/")[2] for path in paths}
        return {name for name in names if _NAME.fullmatch(name)}

    def has(self, part: Part, about: Mapping[str, Any]) -> bool:
        """Return whether the part is there.

        Raises
        ------
        EnsembleError
            The file is damaged, or a part of another ensemble.
        """
        system, root = self._open()
        path = f"{root}/{file_name(part)}"
        try:
            data = system.cat_file(path)
        except FileNotFoundError:
            return False
        _check(path, data, part, about)
        return True

    def write(self, part: Part, table: Table) -> None:
        """Write a part so that it appears as a whole."""
        data = _bytes(table)
        system, root = self._open()
        path = f"{root}/{file_name(part)}"
        if "file" in _protocols(system):
            _write_file(path, data)
        else:
            system.pipe_file(path, data)

    def _open(self) -> tuple[Any, str]:
        import fsspec

        system, root = fsspec.core.url_to_fs(self.path, **self.options)
        # Others write to it, too.
        system.invalidate_cache()
        return system, root.rstrip("/")


def _protocols(system: Any) -> tuple[str, ...]:
    return (system.protocol,) if isinstance(system.protocol, str) else tuple(system.protocol)


def _bytes(table: Table) -> bytes:
    import pyarrow.parquet

    about = {f"lgvi.{key}": str(table.about[key]) for key in _COMMON} | {"lgvi.checksum": _checksum(table)}
    file = io.BytesIO()
    arrow = table.to_arrow().replace_schema_metadata(about)
    pyarrow.parquet.write_table(arrow, file, compression="zstd", write_statistics=False)
    return file.getvalue()


def _checksum(columns: Mapping[str, NDArray[Any]]) -> str:
    """Return the SHA-256 of all names and values."""
    digest = hashlib.sha256()
    for name, column in columns.items():
        texts = column.dtype.kind in "UO"
        digest.update(json.dumps([name, column.tolist() if texts else column.dtype.str, len(column)]).encode())
        if not texts:
            digest.update(column.tobytes())
    return digest.hexdigest()


def _check(path: str, data: bytes, part: Part, about: Mapping[str, Any]) -> None:
    import pyarrow
    import pyarrow.parquet

    damaged = f"{path} is damaged; it is flown again once it is removed"
    try:
        table = pyarrow.parquet.read_table(io.BytesIO(data))
        columns = {name: table[name].to_numpy() for name in table.column_names}
        found = {key.decode(): value.decode() for key, value in (table.schema.metadata or {}).items()}
        checksum = _checksum(columns)
    except (pyarrow.ArrowException, OSError, ValueError, TypeError, KeyError, MemoryError) as error:
        raise EnsembleError(f"{damaged} ({error})") from error
    if found.get("lgvi.checksum") != checksum:
        raise EnsembleError(f"{damaged} (its checksum is another)")
    for key in _COMMON:
        expected, value = str(about[key]), found.get(f"lgvi.{key}")
        if value != expected:
            raise EnsembleError(f"{path} is a part of another ensemble: its {key} is {value}, expected {expected}")
    if not np.array_equal(columns["index"], np.arange(*part)):
        raise EnsembleError(f"{path} has other samples than {part[0]} to {part[1] - 1}")


def _write_file(path: str, data: bytes) -> None:
    """Write a local file under another name, which readers of the directory pass over, and rename it."""
    directory, name = os.path.split(path)
    os.makedirs(directory, exist_ok=True)
    temporary = os.path.join(directory, f".{name}.{uuid.uuid4().hex}")
    try:
        with open(temporary, "xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except BaseException:
        if os.path.exists(temporary):
            os.unlink(temporary)
        raise
