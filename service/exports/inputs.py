"""All inputs of a study, including defaults: numbers, choices, the run.

A default is an input like any other: without it a file does not document what was computed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from sprag_study.service.languages import N_
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.spec.derive import formulas_of
from sprag_study.service.spec.machine.registry import part_of
from sprag_study.worker.directions import SWEEP
from sprag_study.worker.models import HARMONICS, LOAD_TABLE
from sprag_study.worker.models.parameters import parameter_of
from sprag_study.worker.spread import DRIVE

if TYPE_CHECKING:
    from sprag_study.worker.study import Study

#: Origin of the value of an input; "" where the user's spec is unknown.
Origin = Literal["given", "default", "fitted", "axes", "derived", "tolerance", ""]


@dataclass(frozen=True, slots=True)
class Input:
    """One parameter of the machine or setting of its run, for a table of inputs.

    ``value`` is a number in SI (of a parameter with a tolerance the nominal one), the text of a choice, the formula (in
    SI numbers) of a derived parameter, or None where the axes change it. ``formula`` is the formula as it was written,
    with the units of its quantities.
    """

    path: str
    value: float | str | None
    unit: str
    description: str
    origin: Origin
    formula: str = ""

    @property
    def varies(self) -> bool:
        """Whether the axes change it."""
        return self.origin == "axes"


def description_of(study: Study, path: str) -> str:
    """A short description of a flat path of a spec; "" where the catalogue does not contain it."""
    if path == DRIVE:
        return N_("number of the drive; 0 is the nominal one")
    if path == SWEEP:
        return N_("direction of the sweep")
    entry = parameter_of(study, path)
    return "" if entry is None else entry.help


def column_description(study: Study, path: str) -> str:
    """The same for a column of values, with the formula of a derived parameter."""
    text, formula = description_of(study, path), study.derive.get(path)
    return text if formula is None else f"{text}; derived: {formula}".removeprefix("; ")


def inputs(study: Study, spec: Mapping[str, Any]) -> tuple[Input, ...]:
    """Every parameter of the machine: varied ones, which have no single value, derived ones, numbers, and choices.

    ``spec`` is the user's own, which shows what was given.
    """
    varying = study.axis_paths
    drawn = () if study.spread is None else study.spread.paths
    written = formulas_of(spec) if study.derive else {}
    numbers = [
        Input(
            path,
            None if path in varying else study.derive.get(path, study.base.get(path)),
            unit_of(study, path),
            description_of(study, path),
            "axes"
            if path in varying
            else "derived"
            if path in study.derive
            else "tolerance"
            if path in drawn
            else _origin(spec, path),
            written.get(path, study.derive.get(path, "")),
        )
        for path in dict.fromkeys((*varying, *study.derive, *study.base))
    ]
    chosen = [
        Input(choice.path, choice.text, "", choice.meaning, _origin(spec, choice.path))
        for choice in part_of(study.model).choices(study, spec)
    ]
    return (*numbers, *chosen)


def run_inputs(study: Study, spec: Mapping[str, Any]) -> tuple[Input, ...]:
    """The settings of the run, formatted for display; none where the model has no run."""
    given = spec.get("run") or {}
    origins: dict[bool, Origin] = {True: "given", False: "default" if "base" in spec else ""}
    return tuple(
        Input(name, _run_text(name, value), "", "", origins[name in given]) for name, value in study.run.items()
    )


def defaults(study: Study, spec: Mapping[str, Any]) -> list[str]:
    """Paths in the spec (``base.gravity``, ``run.tolerance``) of everything for which a default was used."""
    parts = {"base": inputs(study, spec), "run": run_inputs(study, spec)}
    return [f"{name}.{item.path}" for name, found in parts.items() for item in found if item.origin == "default"]


def choices(study: Study, spec: Mapping[str, Any]) -> dict[str, str]:
    """The non-numeric fields of the machine, by their paths in the base."""
    return {choice.path: choice.text for choice in part_of(study.model).choices(study, spec)}


def _origin(spec: Mapping[str, Any], path: str) -> Origin:
    """Origin of the input at a path of the base."""
    place: Any = spec.get("base")
    if not isinstance(place, Mapping):
        return ""
    if path.startswith(HARMONICS) and "measured" in place["excitation"]:
        return "fitted"
    if path.startswith((LOAD_TABLE, HARMONICS)):
        return "given"
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


def _run_text(name: str, value: object) -> str:
    if value is None:
        return N_("the last third")
    if isinstance(value, Mapping):  # starts
        ranges = "; ".join(f"{path} {_text(ends)}" for path, ends in value["ranges"].items())
        return f"{value['count']}, seed {value['seed']}: {ranges}"
    return f"{value} periods" if name in {"at_most", "max_period"} else _text(value)


def _text(value: object) -> str:
    if isinstance(value, list | tuple):
        if len(value) == 2 and isinstance(value[1], str):
            return f"{value[0]:g} {value[1]}"
        return " to ".join(map(_text, value))
    return f"{value:g}" if isinstance(value, float) else str(value)
