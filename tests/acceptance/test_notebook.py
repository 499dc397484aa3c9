"""The example notebooks run from top to bottom, against a real service."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import nbformat
import pytest
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient

from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.text import load_spec
from sprag_study.worker import models
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


@pytest.fixture
def executed(running: Service, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], list[Any]]:
    """Executes a notebook of the examples, which is stored without outputs; gives its cells with code."""
    monkeypatch.setenv("SPRAG_SERVER", running.address)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    monkeypatch.setenv("JUPYTER_RUNTIME_DIR", str(tmp_path / "runtime"))
    monkeypatch.delenv("SPRAG_TOKEN", raising=False)

    def execute(name: str) -> list[Any]:
        notebook = nbformat.read(EXAMPLES / name, as_version=4)
        cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
        assert [cell.outputs for cell in cells if cell.outputs] == []
        resources = {"metadata": {"path": str(EXAMPLES)}}
        NotebookClient(notebook, timeout=600, kernel_manager_class=ThisPython, resources=resources).execute()
        return cells

    return execute


def test_the_notebook_of_a_service_runs(executed: Callable[[str], list[Any]]) -> None:
    cells = executed("feeder_motor.ipynb")
    said = [outputs(cell) for cell in cells]
    assert "'done': 27" in said[1]
    spec = load_spec((EXAMPLES / "one_pendulum.json").read_bytes(), "json")
    results = models.study_results(parse_spec(spec).study)
    assert f"(27, {len(('case', 'ending', 'flags', *results)) + 2})" in said[5], "and the two axes of the notebook"
    assert "33 cases, 27 of them taken from before" in said[7]
    assert said[8].startswith("/base/shaft/inertia is out of range - allowed: > 0")
    assert "image/png" in cells[4].outputs[-1]["data"]


def test_a_study_goes_from_the_laptop_to_the_office(executed: Callable[[str], list[Any]]) -> None:
    cells = executed("laptop_to_office.ipynb")
    said = [outputs(cell) for cell in cells]
    assert said[0].startswith("Study('Drive of a notebook': 6 cases, 6 ok)")
    assert said[1].count("0.0") >= 1
    assert said[2].startswith("('rad/s', ")
    fastest = float(said[2].split(", ")[1].rstrip(")"))
    assert float(said[3]) == pytest.approx(fastest * 30.0 / math.pi)
    assert float(said[4].split()[-1]) == pytest.approx(fastest)
    assert cells[5].outputs[0]["data"]["image/svg+xml"].lstrip().startswith(("<?xml", "<svg"))
    assert said[6].endswith("'rad/s')")
    assert "True" in said[7], "the best design is feasible"
    assert said[8].endswith("True"), "the service has the same rows"
    assert said[9].split()[-6:] == ["0", "here", "6", "1", "office", "6"]
