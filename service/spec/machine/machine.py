"""The machine of a spec (`base`) of any model: numbers by flat path, and the paths that axes can vary.

Fields are nested like the paths: the number at ``mechanism.slider_crank.crank`` is the one at
``/base/mechanism/slider_crank/crank``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from sprag.sentences import Sentence
from sprag.service.reading.texts import did_you_mean
from sprag.service.spec.fields import missing, read_number, read_object
from sprag.service.spec.report import Report, join

if TYPE_CHECKING:
    from sprag.worker.models import ClutchFit, Parameter


@dataclass
class Machine:
    """The base of a spec, as far as it could be read.

    Attributes
    ----------
    values : flat path -> SI number; incomplete when faults were recorded
    parameters : flat path -> parameter, for every number that an axis can vary
    structure : its non-numeric part as stored in a study; None where the model has none or it could not be read
    derive : flat path -> formula in SI numbers, for every number that is derived from others
    """

    values: dict[str, float] = field(default_factory=dict)
    parameters: dict[str, Parameter] = field(default_factory=dict)
    structure: dict[str, Any] | None = None
    derive: dict[str, str] = field(default_factory=dict)

    @property
    def fits(self) -> dict[str, ClutchFit]:
        """JSON Pointer of each fitted clutch -> its fit."""
        return {}

    def assumed(self, path: str) -> bool:  # noqa: ARG002 - some models need it
        """Whether ``path`` may belong to a part of the base that could not be read."""
        return False

    def why_not(self, path: str) -> Sentence:
        """A sentence that explains why an axis cannot vary ``path``, and what it can vary."""
        known = tuple(self.parameters)
        hint = did_you_mean(path.removeprefix("base."), known)
        return Sentence("is not a numeric parameter of the base{hint}", hint=hint)


def read_plain(report: Report, data: object, catalogue: tuple[Parameter, ...]) -> Machine:
    """Read the machine of a model that is fully described by ``catalogue``: plain numbers, no lists, no choices."""
    machine = Machine(parameters={entry.path: entry for entry in catalogue})
    found = read_object(report, "/base", data, _fields("", machine))
    if found is not None:
        _check_parts(report, "", found, machine)
        read_numbers(report, found, machine)
    return machine


def read_numbers(report: Report, data: Mapping[str, Any], machine: Machine) -> None:
    """Read the numbers of the machine's parameters into its values; faults are recorded."""
    for path, entry in machine.parameters.items():
        number = _read(report, data, path, entry)
        if number is not None:
            machine.values[path] = number


def _fields(prefix: str, machine: Machine) -> list[str]:
    """Names of the fields of the object at a path."""
    rests = (path.removeprefix(prefix) for path in machine.parameters if path.startswith(prefix))
    return list(dict.fromkeys(rest.split(".")[0] for rest in rests))


def _check_parts(report: Report, prefix: str, data: Mapping[str, Any], machine: Machine) -> None:
    """Note every part of an object that is not an object itself, or has a field that no parameter is in."""
    for name in _fields(prefix, machine):
        part = f"{prefix}{name}"
        if part not in machine.parameters and name in data:
            found = read_object(report, join("/base", *part.split(".")), data[name], _fields(f"{part}.", machine))
            if found is not None:
                _check_parts(report, f"{part}.", found, machine)


def _read(report: Report, found: Mapping[str, Any], path: str, entry: Parameter) -> float | None:
    """The number at a flat path of the base; None, with a fault recorded, when it is missing or invalid."""
    place: Any = found
    keys: list[str | int] = []
    for key in path.split("."):
        index: str | int = int(key) if isinstance(place, list) else key
        keys.append(index)
        inside = isinstance(place, list) or (isinstance(place, Mapping) and key in place)
        if not inside:
            break
        place = place[index]
    else:
        return read_number(report, join("/base", *keys), place, entry)
    if entry.default is None:
        missing(report, join("/base", *path.split(".")), entry)
        return None
    # An open end of a range is not a number that could be stored.
    return entry.default if entry.accepts(entry.default) else None
