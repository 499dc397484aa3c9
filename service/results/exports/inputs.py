"""Everything that a study was computed with, what the user left to the program included: numbers, choices, the run.

A default that nobody wrote is an input like any other: without it a file does not say what was computed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from inspect import signature
from typing import TYPE_CHECKING, Any, Final, Literal

from service.spec.catalogue import parameter_of, unit_of
from worker import models

if TYPE_CHECKING:
    from worker.study import Study

#: Where the value of an input is from; "" where the user's own spec is not known.
Origin = Literal["given", "default", "fitted", "axes", ""]

#: What of a machine is no number, by its path; of a clutch that is fitted, by the last part of it.
_MEANINGS: Final = {
    "cycle": "revolutions of a cycle",
    "mean_speed_is": "mean that mean_speed and the irregularity refer to",
    "balance": "what makes the work over a cycle zero",
    "phi_c": "angle with T = T_mean from which S3 and S4 count, from 0",
    "drive.motor.kind": "kind of the motor",
    "drive.torque.interpolation": "between the rows of the torque's table",
    "mechanism": "the mechanism",
    "mechanism.quick_return.kind": "kind of the quick return",
    "mechanism.cam.rise": "law of the rise",
    "mechanism.cam.fall": "law of the fall",
    "mechanism.interpolation": "between the rows of the mechanism's table",
    "operation": "how the resistance is given",
    "operation.quantity": "what the diagram is of",
    "operation.over": "what the diagram goes over",
    "operation.during": "strokes in which the diagram holds",
    "operation.sense": "direction of the force",
    "operation.interpolation": "between the rows of the operation's table",
    "windup_limit": "largest windup; none: the law holds for any",
    "max_degree": "largest degree that the fit may have",
    "through_origin": "whether the fitted torque begins at 0",
    "angles_include_backlash": "whether the measured angles begin before the backlash is taken up",
}
_FIT_OPTIONS: Final = ("max_degree", "through_origin", "angles_include_backlash")


@dataclass(frozen=True, slots=True)
class Input:
    """One parameter of the machine, or setting of its run, as a table of inputs shows it.

    ``value`` is a number in SI, the text of a choice, or None where the axes change it.
    """

    path: str
    value: float | str | None
    unit: str
    description: str
    origin: Origin

    @property
    def varies(self) -> bool:
        """Whether the axes change it."""
        return self.origin == "axes"


def description_of(study: Study, path: str) -> str:
    """What a flat path in a spec means, as a few words; "" where the catalogue does not have it."""
    entry = parameter_of(study, path)
    return "" if entry is None else entry.help


def inputs(study: Study, spec: Mapping[str, Any]) -> tuple[Input, ...]:
    """Every parameter of the machine: what varies, which has no single value, the base's numbers, and the choices.

    ``spec`` is the user's own, which tells what was given.
    """
    varying = study.axis_paths
    numbers = [
        Input(
            path,
            None if path in varying else study.base[path],
            unit_of(study, path),
            description_of(study, path),
            "axes" if path in varying else _origin(spec, path),
        )
        for path in dict.fromkeys((*varying, *study.base))
    ]
    chosen = [
        Input(path, text, "", _MEANINGS.get(path) or _MEANINGS[path.rpartition(".")[2]], _origin(spec, path))
        for path, text in choices(study, spec).items()
    ]
    return (*numbers, *chosen)


def run_inputs(study: Study, spec: Mapping[str, Any]) -> tuple[Input, ...]:
    """The settings of the run as people read them; none where the model has no run."""
    given = spec.get("run") or {}
    origins: dict[bool, Origin] = {True: "given", False: "default" if "base" in spec else ""}
    return tuple(
        Input(name, "the last third" if value is None else _text(value), "", "", origins[name in given])
        for name, value in study.run.items()
    )


def defaults(study: Study, spec: Mapping[str, Any]) -> list[str]:
    """Paths under the spec (``base.gravity``, ``run.tolerance``) of everything that the user left to the program."""
    parts = {"base": inputs(study, spec), "run": run_inputs(study, spec)}
    return [f"{name}.{item.path}" for name, found in parts.items() for item in found if item.origin == "default"]


def choices(study: Study, spec: Mapping[str, Any]) -> dict[str, str]:
    """What of the machine is no number, by its path in the base."""
    return dict(_fit_choices(study, spec) if study.structure is None else _shaft_choices(study.structure))


def _fit_choices(study: Study, spec: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    base = spec.get("base") or {}
    places = [("clutch", base)] if "clutch" in base else []
    places += [(f"pendulums.{index}.clutch", item) for index, item in enumerate(base.get("pendulums") or ())]
    for place, owner in places:
        clutch = owner.get("clutch") or {}
        if "data" in clutch:
            usual = signature(models.fit_clutch).parameters
            for name in _FIT_OPTIONS:
                value = clutch.get(name, usual[name].default)
                yield f"{place}.{name}", str(value).lower()
        elif clutch and f"{place}.windup_limit" not in (*study.base, *study.axis_paths):
            yield f"{place}.windup_limit", "none"


def _shaft_choices(structure: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    drive, mechanism, operation = (structure[name] for name in ("drive", "mechanism", "operation"))
    cycle, phi_c = structure["cycle"], structure["phi_c"]
    yield "cycle", f"{cycle} revolution{'s' if cycle > 1 else ''}"
    yield "mean_speed_is", structure["mean_speed_is"]
    yield "balance", structure["balance"]
    yield "phi_c", "the first at which T rises" if phi_c is None else str(phi_c)
    if drive["motor"]:
        yield "drive.motor.kind", drive["motor"]
    if drive["table"]:
        yield "drive.torque.interpolation", drive["table"]["interpolation"]
    yield "mechanism", mechanism["kind"]
    if "quick_return" in mechanism:
        yield "mechanism.quick_return.kind", mechanism["quick_return"]
    for law in ("rise", "fall"):
        if law in mechanism:
            yield f"mechanism.cam.{law}", mechanism[law]
    if mechanism.get("table"):
        yield "mechanism.interpolation", mechanism["table"]["interpolation"]
    yield from _operation_choices(operation)


def _operation_choices(operation: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    form = operation.get("form", operation["quantity"])  # a gas has no form, nothing that resists has neither
    yield "operation", "value" if form == "constant" else form
    if "form" not in operation:
        return
    used = ["quantity", "over", *(["during"] if operation["over"] == "stroke" else [])]
    for name in [*used, *(["sense"] if operation["quantity"] == "force" else [])]:
        yield f"operation.{name}", operation[name]
    if operation.get("table"):
        yield "operation.interpolation", operation["table"]["interpolation"]


def _origin(spec: Mapping[str, Any], path: str) -> Origin:
    """Where the input at a path of the base is from."""
    place: Any = spec.get("base")
    if not isinstance(place, Mapping):
        return ""
    for key in path.split("."):
        if isinstance(place, Mapping) and "data" in place and key in ("coefficients", "windup_limit"):
            return "fitted"
        if isinstance(place, Mapping) and key in place:
            place = place[key]
        elif isinstance(place, list) and key.isdigit() and int(key) < len(place):
            place = place[int(key)]
        else:
            return "default"
    return "default" if place is None else "given"


def _text(value: object) -> str:
    if isinstance(value, list | tuple):
        if len(value) == 2 and isinstance(value[1], str):
            return f"{value[0]:g} {value[1]}"
        return " to ".join(map(_text, value))
    return f"{value:g}" if isinstance(value, float) else str(value)
