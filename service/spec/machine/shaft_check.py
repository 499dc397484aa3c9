"""Checks of a machine shaft as a whole: parts that do not fit together, and machines without a steady cycle."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from functools import cache, partial
from typing import Any, Final, cast

from sprag_study.sentences import Amount, Sentence, plural
from sprag_study.service.faults import Code
from sprag_study.service.spec.fields import base_pointer
from sprag_study.service.spec.report import Report
from sprag_study.worker.models import (
    AssemblyError,
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
from sprag_study.worker.pool.child_process import uncounted

#: Pointer of the fault for each ending.
_POINTERS: Final[dict[Ending | None, str]] = {
    Ending.UNBALANCED_WORK: "/base/balance",
    Ending.NEGATIVE_INERTIA: "/base/drive/inertia",
    Ending.MOTOR_STALLED: "/base/drive/motor",
    Ending.MOTOR_OVERRUN: "/base/drive/motor",
}
_UNSTABLE: Final = Sentence(
    "the steady motion of this machine is unstable: deviations of the speed grow in every cycle, so a case of it ends "
    "as `unstable_motion`, with the multiplier of the cycle"
)
#: Distance of a harmonic from a natural frequency, as a share of that, below which it is warned of.
_NEAR_RESONANCE: Final = 0.05
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


def compiles_here() -> bool:
    """Whether checks in this process compile the kernels that they need."""
    return _compiles_here


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
    for place, alone, formula in _alone(structure):
        _note(report, places[place], partial(machine_shaft.check_structure, alone), formula)
        if report.found > before:
            return
    _note(report, "/base", partial(machine_shaft.check_structure, structure))
    if report.found > before:
        return
    try:
        if machine_shaft.check(structure, values) is Ending.UNSTABLE:
            report.warn("unstable-motion", "/base", _UNSTABLE)
        other = machine_shaft.other_speed(structure, values)
        if math.isfinite(other):
            message = Sentence(
                "the torques of this machine balance at about {speed} too, so that its shaft may turn steadily at more "
                "speeds than the one of the results: the section of all steady speeds of a case has them",
                speed=Amount(other, "rad/s", 4),
            )
            report.warn("several-speeds", "/base", message)
        if "coupling" in structure["drive"].get("stages", ()):
            _warn_of_torsion(report, machine_shaft.base_results(structure, values), structure["cycle"])
    except ExpressionError as error:
        formula = _at(structure, error.part).get("formula") if error.part in places else None
        report.fault(places.get(error.part, "/base"), "invalid-formula", error.message, formula)
    except InsufficientInertiaError as error:
        report.fault(
            "/base/mean_speed", "inertia-insufficient", error.message, error.asked, allowed=error.allowed, unit="rad/s"
        )
    except machine_shaft.RelationError as error:
        report.fault(base_pointer(error.path), "conflict", error.message, error.value, allowed=error.allowed)
    except MachineError as error:
        where = _pointer(error, structure, places)
        report.fault(where, code_of(error), error.message, error.found, allowed=error.allowed)


def _warn_of_torsion(report: Report, results: Mapping[str, float], turns: int) -> None:
    """Warn of a harmonic of the cycle near a natural frequency of the train, and of torques that change their sign."""
    order, margin, factor = (results[f"torsion.{name}"] for name in ("order", "margin", "dynamic_factor"))
    if margin < _NEAR_RESONANCE and factor > 1.0:
        near = Sentence(
            "harmonic {order} of the cycle, {speed}, is within {margin} of a torsional natural frequency of the train; "
            "the largest dynamic factor of its couplings is {factor}",
            order=str(round(order)),
            speed=Amount(order * results["omega.mean_time"] / turns, "rad/s", 4),
            margin=Amount(100.0 * margin, "%", 2),
            factor=Amount(factor, digits=4),
        )
        report.warn("near-resonance", "/base/drive/stages", near)
    if results["torsion.reversals"] > 0:
        count = round(results["torsion.reversals"])
        turned = plural(
            "the torque of {count} coupling changes its sign within the cycle; with backlash in the train it would "
            "lift off and strike there, which the linear train leaves out",
            "the torque of {count} couplings changes its sign within the cycle; with backlash in the train they would "
            "lift off and strike there, which the linear train leaves out",
            count,
        )
        report.warn("torque-reverses", "/base/drive/stages", turned)


def _alone(structure: Mapping[str, Any]) -> Iterator[tuple[str, dict[str, Any], Any]]:
    """Each part by itself, an operation with its mechanism, so that a fault is reported at its place: the place, the
    structure with nothing else, and the part's formula.
    """
    whole = {name: value for name, value in structure.items() if name != "parts"}
    given = structure["balance"] if structure["balance"] != "motor" else "constant"
    yield "drive", {**whole, "mechanism": _NEUTRAL["mechanism"], "operation": {}}, structure["drive"].get("formula")
    owners = [(f"parts.{k}.", part) for k, part in enumerate(structure.get("parts", ()))] or [("", structure)]
    for prefix, own in owners:
        neutral = {**whole, **_NEUTRAL, "balance": given}
        for name in ("mechanism", "operation"):
            with_mechanism = {**neutral, "mechanism": own["mechanism"], name: own[name]}
            yield f"{prefix}{name}", with_mechanism, own[name].get("formula")


def _at(structure: Mapping[str, Any], place: str) -> Mapping[str, Any]:
    """The part of a structure at a place such as "drive" or "parts.0.mechanism"."""
    *owner, name = place.split(".")
    found: Mapping[str, Any] = (structure["parts"][int(owner[1])] if owner else structure)[name]
    return found


def _pointer(error: MachineError, structure: Mapping[str, Any], places: Mapping[str, str]) -> str:
    """Where the fault of a machine as a whole is reported."""
    if isinstance(error, AssemblyError):
        return places[f"{error.prefix}mechanism"]
    only = "parts" not in structure
    if only and error.ending is Ending.NEAR_SINGULAR:
        return places["mechanism"]
    if only and error.ending is Ending.NEGATIVE_INERTIA and structure["mechanism"]["kind"] in {"table", "formula"}:
        return places["mechanism"]
    return _POINTERS.get(error.ending) or "/base"


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
        found = value if error.found is None else error.found
        report.fault(pointer, code_of(error), error.message, found, allowed=error.allowed)
