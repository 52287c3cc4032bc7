"""The session of docs/python.md."""

from __future__ import annotations

import re
from pathlib import Path

import pytest


def test_the_session_of_the_page_runs(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    (tmp_path / "bags").symlink_to(root / "bags")
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"^```python\n(.*?)^```$", (root / "docs" / "python.md").read_text(), re.MULTILINE | re.DOTALL)
    assert len(blocks) >= 8
    session: dict[str, object] = {}
    for block in blocks:
        exec(block, session)
    printed = capsys.readouterr().out
    misses = re.findall(r"^miss: (\S+) m$", printed, re.MULTILINE)
    assert len(misses) == 2 and all(float(miss) < 1e-11 for miss in misses)
    orders = re.findall(r"^order (\d): .* observed order (\S+)$", printed, re.MULTILINE)
    assert len(orders) == 3 and all(abs(float(seen) - int(order)) < 1.0 for order, seen in orders)
    assert "bodies[0].mass -1.0 a finite number > 0" in printed
