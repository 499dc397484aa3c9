"""The example notebook runs from top to bottom against a real service."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import nbformat
import pytest
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient

from tests.acceptance.processes import EXAMPLES, ROOT, Service


class ThisPython(AsyncKernelManager):
    """A kernel of the interpreter that runs the tests, whatever kernels the machine knows."""

    def format_kernel_cmd(self, extra_arguments: list[str] | None = None) -> list[str]:
        """The command that starts it."""
        return [sys.executable, "-m", "ipykernel_launcher", "-f", self.connection_file, *(extra_arguments or [])]


def outputs(cell: Any) -> str:
    """What a cell printed and gave, as text."""
    parts = [output.get("text", "") or output.get("data", {}).get("text/plain", "") for output in cell.outputs]
    return "".join(parts)


def test_the_example_notebook_runs(running: Service, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    notebook = nbformat.read(EXAMPLES / "feeder_motor.ipynb", as_version=4)
    assert [cell.outputs for cell in notebook.cells if cell.cell_type == "code" and cell.outputs] == []
    monkeypatch.setenv("SPRAG_SERVER", running.address)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    monkeypatch.setenv("JUPYTER_RUNTIME_DIR", str(tmp_path / "runtime"))
    monkeypatch.delenv("SPRAG_TOKEN", raising=False)
    NotebookClient(
        notebook,
        timeout=600,
        kernel_manager_class=ThisPython,
        resources={"metadata": {"path": str(EXAMPLES)}},
    ).execute()
    said = [outputs(cell) for cell in notebook.cells if cell.cell_type == "code"]
    assert "'done': 27" in said[1]
    assert "(27, 73)" in said[5]
    assert "33 cases, 27 of them taken from before" in said[7]
    assert said[8].startswith("/base/shaft/inertia is out of range - allowed: > 0")
    codes = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert "image/png" in codes[4].outputs[-1]["data"]
