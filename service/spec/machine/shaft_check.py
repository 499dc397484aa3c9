"""Checks of a machine shaft as a whole: parts that do not fit together, and machines without a steady cycle."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, partial
from typing import Any, Final, cast

from sprag.service.faults import Code
from sprag.service.spec.report import Report
from sprag.worker.models import (
    Ending,
    ExpressionError,
    InsufficientInertiaError,
    KernelShape,
    MachineError,
    TableError,
    is_compiled,
    load,
    machine_shaft,
)
from sprag.worker.pool.child_process import uncounted

#: Pointer of the fault for each ending.
_POINTERS: Final[dict[Ending | None, str]] = {
    Ending.UNBALANCED_WORK: "/base/balance",
    Ending.NEGATIVE_INERTIA: "/base/drive/inertia",
    Ending.MOTOR_STALLED: "/base/drive/motor",
    Ending.MOTOR_OVERRUN: "/base/drive/motor",
}
_PARTS: Final = ("mechanism", "drive", "operation")
_NEUTRAL: Final[dict[str, dict[str, Any]]] = {"drive": {}, "mechanism": {"kind": "none"}, "operation": {}}


class NotCompiledError(Exception):
    """The kernel of ``shape`` is needed and must be compiled elsewhere: see `compile_elsewhere`."""

    def __init__(self, shape: KernelShape) -> None:
        super().__init__(shape)
        self.shape = shape


_compiles_here = True


def compile_elsewhere() -> None:
    """From now on checks in this process raise NotCompiledError instead of compiling, which can take a minute."""
    global _compiles_here  # noqa: PLW0603 - a habit of the whole process
    _compiles_here = False


@cache
def _load(shape: KernelShape) -> None:
    """Load the kernels from the cache on disk, once per process, outside the time limit of any spec."""
    with uncounted():
        load(shape)


def check_machine(
    report: Report, structure: Mapping[str, Any], values: Mapping[str, float], places: Mapping[str, str]
) -> None:
    """Record the faults of a machine whose numbers are all in range.

    Parameters
    ----------
    structure : as stored in a study
    values : flat path -> SI number, complete for the structure
    places : part -> JSON Pointer of its formula, its table, or the whole part
    """
    shape = machine_shaft.SHAPE
    if not _compiles_here:
        if not is_compiled(shape):
            raise NotCompiledError(shape)
        _load(shape)
    before = report.found
    for part in _PARTS:
        # Each part alone (an operation with its mechanism), so that a fault is reported at its place.
        alone = {name: structure[name] if name in {part, "mechanism"} else _NEUTRAL[name] for name in _PARTS}
        own = {**structure, **alone}
        if part != "drive" and structure["balance"] == "motor":
            own["balance"] = "constant"
        _note(report, places[part], partial(machine_shaft.check_structure, own), structure[part].get("formula"))
        if report.found > before:
            return
    _note(report, "/base", partial(machine_shaft.check_structure, structure))
    if report.found > before:
        return
    try:
        machine_shaft.check(structure, values)
    except ExpressionError as error:
        report.fault(
            places.get(error.part, "/base"), "invalid-formula", str(error), structure.get(error.part, {}).get("formula")
        )
    except InsufficientInertiaError as error:
        allowed = f"> {error.least_mean_speed:.6g} rad/s"
        report.fault("/base/mean_speed", "inertia-insufficient", str(error), error.asked, allowed=allowed, unit="rad/s")
    except machine_shaft.RelationError as error:
        report.fault(
            "/base/" + error.path.replace(".", "/"), "conflict", str(error), error.value, allowed=error.allowed
        )
    except MachineError as error:
        pointer = _POINTERS.get(error.ending)
        if error.ending in {Ending.CANNOT_ASSEMBLE, Ending.NEAR_SINGULAR}:
            pointer = places["mechanism"]
        if error.ending is Ending.NEGATIVE_INERTIA and structure["mechanism"]["kind"] in {"table", "formula"}:
            pointer = places["mechanism"]
        report.fault(pointer or "/base", code_of(error), str(error))


def code_of(error: MachineError) -> Code:
    """The code of a fault that concerns the machine as a whole or one of its tables and formulas."""
    if isinstance(error, ExpressionError):
        return "invalid-formula"
    if isinstance(error, TableError):
        return "invalid-table"
    # The code is the name of the ending that a case of a grid would have.
    return "invalid-machine" if error.ending is None else cast("Code", error.ending.value.replace("_", "-"))


def _note(report: Report, pointer: str, check: Callable[[], None], value: object = None) -> None:
    try:
        check()
    except MachineError as error:
        report.fault(pointer, code_of(error), str(error), value)
