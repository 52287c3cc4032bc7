"""Executes the notebooks beside this file. An exception in one ends it; outputs are not kept."""

from __future__ import annotations

import sys
from pathlib import Path

import nbformat
from jupyter_client import KernelManager
from nbclient import NotebookClient


def main() -> None:
    """Execute all notebooks, or those that are named."""
    directory = Path(__file__).parent
    names = [Path(name) for name in sys.argv[1:]] or sorted(directory.glob("*.ipynb"))
    for name in names:
        notebook = nbformat.read(name, as_version=4)
        if any(cell.get("outputs") for cell in notebook.cells):
            raise SystemExit(f"{name.name} has outputs, expected none: `jupyter nbconvert --clear-output --inplace` clears them")
        manager = KernelManager(kernel_name="python3", transport="ipc")
        try:
            NotebookClient(notebook, timeout=120, km=manager).execute()
        finally:
            manager.shutdown_kernel(now=True)
        print(f"{name.name}: {len(notebook.cells)} cells")


if __name__ == "__main__":
    main()
