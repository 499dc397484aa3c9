"""Codes of faults: listed, explained on a page, raised somewhere, and the same in another process."""

from __future__ import annotations

import pickle
import re
from typing import get_args

import pytest

from sprag_study.engine import Ending
from sprag_study.engine.machine_shaft import problems
from sprag_study.sentences import WarningText
from sprag_study.service import faults
from sprag_study.service.faults import Code, Fault, FaultError, Kind, ParameterFault, SelectionError, WarningCode
from sprag_study.service.http.problems import PROBLEM_TYPES
from sprag_study.service.spec.report import SpecError
from sprag_study.service.storage import errors as storage
from sprag_study.service.storage.stored_sentences import read_warnings, write_warnings
from sprag_study.worker.ports import StoreError
from tests.conftest import ROOT

PAGE = (ROOT / "docs" / "faults.md").read_text(encoding="utf-8")
SOURCES = "\n".join(
    path.read_text(encoding="utf-8")
    for package in ("service", "worker", "engine", "sprag")
    for path in (ROOT / package).rglob("*.py")
    if path.resolve() not in {(ROOT / "service" / name).resolve() for name in ("faults.py", "http/problems.py")}
)


def test_every_code_is_explained_once_on_the_page() -> None:
    page, _, warnings = PAGE.partition("## Warnings")
    rows, warned = (re.findall(r"^\| `([a-z-]+)` \| .+ \|$", part, re.MULTILINE) for part in (page, warnings))
    # Kinds that are problems over HTTP are explained by the service itself.
    assert sorted(rows) == sorted([*get_args(Code), *({*get_args(Kind)} - {*PROBLEM_TYPES})])
    assert {*PROBLEM_TYPES} <= {*get_args(Kind)}
    assert warned == sorted(get_args(WarningCode))


def test_every_warning_of_engine_and_worker_has_a_listed_code() -> None:
    told = re.findall(r"WarningText\(text, \"([a-z-]+)\"\)", SOURCES)
    assert len(told) > 5
    assert {*told} <= {*get_args(WarningCode)}


@pytest.mark.parametrize("code", sorted({*get_args(Code), *get_args(Kind), *get_args(WarningCode)}))
def test_every_code_is_raised_somewhere(code: str) -> None:
    assert f'"{code}"' in SOURCES or code.replace("-", "_") in [*Ending]


def test_every_error_of_the_store_has_a_kind() -> None:
    kinds = {
        error.code for error in vars(storage).values() if isinstance(error, type) and issubclass(error, StoreError)
    }
    assert kinds <= {*get_args(Kind)}


def test_every_fault_of_a_machine_is_told_with_a_code() -> None:
    from sprag_study.service.spec.machine.shaft_check import code_of

    told = {code_of(kind.__new__(kind)) for kind in vars(problems).values() if isinstance(kind, type) and
            issubclass(kind, problems.MachineError)}  # fmt: skip
    assert told <= {*get_args(Code)}


@pytest.mark.parametrize(
    "error",
    [
        SpecError([Fault("/run", "wrong-type", "must be an object", 1, "an object")]),
        SelectionError([ParameterFault("at", "unknown-value", "the axis has no such value")]),
        FaultError("queue-full", "Too many studies wait.", retry_after=5),
        storage.StudyNotFoundError("st_1"),
    ],
)
def test_a_fault_is_the_same_in_another_process(error: Exception) -> None:
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again), vars(again)) == (type(error), str(error), vars(error))


def test_a_warning_is_the_same_in_another_process_and_in_the_database() -> None:
    warning = WarningText("odd", "no-effect")
    again = pickle.loads(pickle.dumps(warning))
    stored = read_warnings(write_warnings([warning, "older"]))
    assert faults.warned([again, *stored]) == {
        "warnings": ["odd", "odd", "older"],
        "warning_codes": ["no-effect", "no-effect", None],
    }


def test_a_fault_as_text_and_as_data() -> None:
    fault = Fault("/a", "out-of-range", "is out of range", -1, "> 0 m", "m")
    assert str(fault) == "/a: is out of range (got -1; allowed: > 0 m)"
    told = {"code": "out-of-range", "message": "is out of range", "value": -1, "allowed": "> 0 m", "unit": "m"}
    assert fault.to_json() == {"pointer": "/a", **told}
    assert faults.parameter_error("x", "required", "is missing").faults[0].to_json()["parameter"] == "x"
