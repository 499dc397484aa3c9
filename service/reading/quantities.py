"""Kinds of quantities and the units in which people can have them shown: the only place that converts for display.

A choice of units is a text: ``si``; ``workshop``, the units that a workshop has for machines of the model; ``typed``,
those in which the study was written; or a list such as ``rpm, mm, N*mm`` or ``speed=rpm, frequency=rpm``, with
``workshop`` or ``typed`` in it for the rest, which is in SI otherwise.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.sentences import Sentence
from sprag_study.service.faults import refused
from sprag_study.service.reading.catalogue import result_of, unit_of
from sprag_study.service.reading.cyrillic import latin
from sprag_study.service.reading.units import QuantityError, parse_quantity, plain_signs, split_quantity
from sprag_study.worker import models

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.worker.study import Study

SI: Final = "si"
TYPED: Final = "typed"
WORKSHOP: Final = "workshop"
_LONGEST: Final = 400
#: Keys of a spec beside which values of a parameter or of a result stand.
_NAMING: Final = ("path", "paths", "result")


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of quantity: its name in choices, its title, its SI unit, and the units offered beside it."""

    name: str
    title: str
    unit: str
    others: tuple[str, ...]


KINDS: Final = (
    Kind("angle", "Angle", "rad", ("deg",)),
    Kind("speed", "Angular speed", "rad/s", ("rpm", "deg/s")),
    Kind("angular_acceleration", "Angular acceleration", "rad/s^2", ("deg/s^2",)),
    Kind("frequency", "Frequency", "Hz", ("rpm",)),
    Kind("time", "Time", "s", ("ms", "min")),
    Kind("length", "Length", "m", ("mm", "cm", "in")),
    Kind("velocity", "Velocity", "m/s", ("mm/s",)),
    Kind("acceleration", "Acceleration", "m/s^2", ("mm/s^2", "g0")),
    Kind("area", "Area", "m^2", ("mm^2", "cm^2")),
    Kind("mass", "Mass", "kg", ("g", "t", "lb")),
    Kind("density", "Density", "kg/m^3", ("g/cm^3",)),
    Kind("inertia", "Moment of inertia", "kg*m^2", ("kg*cm^2", "kg*mm^2", "g*cm^2")),
    Kind("force", "Force", "N", ("kN", "lbf")),
    Kind("torque", "Torque", "N*m", ("N*mm", "N*cm", "kN*m", "lbf*ft", "lbf*in")),
    Kind("energy", "Energy", "J", ("mJ", "kJ")),
    Kind("power", "Power", "W", ("mW", "kW", "hp", "PS")),
    Kind("pressure", "Pressure", "Pa", ("kPa", "MPa", "bar")),
    Kind("spring_rate", "Spring rate", "N/m", ("N/mm", "kN/m")),
    Kind("damping", "Damping", "N*m*s/rad", ("N*mm*s/rad",)),
    Kind("share", "Efficiencies and shares", models.SHARE, ("%",)),
)
_TORQUE: Final = "N*m"
#: SI units of the coefficients of a torque over an angle: N*m/rad, N*m/rad^2.
_COEFFICIENT: Final = re.compile(r"N\*m(/rad(?:\^\d+)?)")
_BY_NAME: Final = {kind.name: kind for kind in KINDS}
_BY_UNIT: Final = {kind.unit: kind for kind in KINDS}


def offered(si: str) -> tuple[str, ...]:
    """The units in which a quantity of the SI unit can be typed by a choice, that one first; none of a plain number."""
    if si in ("", "1"):
        return ()
    return (si, *_BY_UNIT[si].others) if si in _BY_UNIT else (si,)


def is_si(unit: str) -> bool:
    """Whether plain numbers are in this unit, where it is one of those offered."""
    return unit in _BY_UNIT or not any(unit in kind.others for kind in KINDS)


def _pattern() -> str:
    """A regular expression of ECMA 262 for choices of units as `read_units` takes them."""
    units = {kind.name: [re.escape(unit) for unit in (kind.unit, *kind.others)] for kind in KINDS}
    alone = dict.fromkeys((SI, TYPED, WORKSHOP, *(unit for some in units.values() for unit in some)))
    part = "|".join((*alone, *(f"{name}=({'|'.join(some)})" for name, some in units.items())))
    return f"^(({part})(,({part}))*)?$"


UNITS_PATTERN: Final = _pattern()


@lru_cache(maxsize=1024)
def _size(unit: str, si: str) -> float:
    """One ``unit`` in SI; raises QuantityError."""
    return 1.0 if unit == si else parse_quantity(f"1 {unit}", si)


#: Zeros that count less for a unit than one other number.
_MUCH: Final = 1_000_000


@dataclass(frozen=True, slots=True)
class Units:
    """The unit in which each kind is shown: ``chosen`` maps SI units to others; what it lacks is shown in SI.

    A share has the unit `models.SHARE`, which tells it from other numbers without a unit.
    """

    chosen: Mapping[str, str] = field(default_factory=dict)

    def unit(self, si: str) -> str:
        """The unit in which quantities of the SI unit are shown; of coefficients of a torque that of the torque too."""
        of_torque = _COEFFICIENT.fullmatch(si)
        if of_torque is not None:
            return f"{self.unit(_TORQUE)}{of_torque[1]}"
        return si if si == "1" and not isinstance(si, models.Share) else self.chosen.get(si, si)

    def value(self, value: float, si: str) -> float:
        """A number in SI in the unit in which it is shown."""
        unit = self.unit(si)
        return value if unit == si else value / _size(unit, si)

    def cell(self, value: Any, si: str) -> Any:
        """A cell of a table: a number in its unit; texts and missing numbers as they are."""
        return self.value(value, si) if isinstance(value, float) else value

    def values(self, values: NDArray[np.float64], si: str) -> NDArray[np.float64]:
        """The same for an array of any shape."""
        unit = self.unit(si)
        return values if unit == si else np.asarray(values / _size(unit, si))

    @property
    def text(self) -> str:
        """The choice as a text for an address."""
        return ",".join(f"{_BY_UNIT[si].name}={unit}" for si, unit in self.chosen.items()) or SI


def read_units(text: str) -> tuple[str, dict[str, str]]:
    """How the rest is shown, `SI`, `TYPED` or `WORKSHOP`, and the chosen units by SI unit.

    Raises
    ------
    SelectionError
        About ``units``, for what is neither a unit nor a kind of quantity, and for a unit of another kind.
    """
    if len(text) > _LONGEST:
        raise refused(
            "units", "too-long", "is too long", allowed=Sentence("<= {count} characters", count=str(_LONGEST))
        )
    rest, chosen = SI, dict[str, str]()
    for part in latin(plain_signs(text)).replace("rev/min", "rpm").split(","):
        name, separator, unit = (piece.strip() for piece in part.partition("="))
        if not separator:
            if (own := name.lower()) in ("", SI, TYPED, WORKSHOP):
                rest = rest if own in ("", SI) else own
                continue
            kind, unit = _kind_with(name, part.strip()), name
        elif name in _BY_NAME:
            kind = _BY_NAME[name]
        else:
            raise refused("units", "invalid-choice", "is not a kind of quantity", name, allowed=", ".join(_BY_NAME))
        if unit not in (kind.unit, *kind.others):
            message = f"is not a unit that {kind.title.lower()} is shown in"
            raise refused("units", "invalid-choice", message, unit, allowed=", ".join((kind.unit, *kind.others)))
        chosen[kind.unit] = unit
    return rest, chosen


def _kind_with(unit: str, given: str) -> Kind:
    """The first kind that has the unit: rpm are those of angular speeds."""
    found = next((kind for kind in KINDS if unit in (kind.unit, *kind.others)), None)
    if found is None:
        known = ", ".join(dict.fromkeys(unit for kind in KINDS for unit in (kind.unit, *kind.others)))
        raise refused(
            "units", "invalid-choice", "is neither si, workshop, typed nor a unit that quantities are shown in", given,
            allowed=f"si, workshop, typed, {known}",
        )  # fmt: skip
    return found


def units_for(study: Study, spec: Mapping[str, Any], text: str) -> Units:
    """The units of a choice for a study; raises SelectionError as `read_units` does."""
    rest, chosen = read_units(text)
    others = typed_units(study, spec) if rest == TYPED else workshop_units(study.model) if rest == WORKSHOP else {}
    return Units({si: unit for si, unit in {**others, **chosen}.items() if unit != si})


def preferred(choice: str, model: str) -> dict[str, str]:
    """The unit in which plain numbers of each kind are shown, by SI unit; raises SelectionError as `read_units`."""
    rest, chosen = read_units(choice)
    return ({} if rest == SI else workshop_units(model)) | chosen


def workshop_units(model: str) -> dict[str, str]:
    """The units of a workshop for machines of a model, by SI unit."""
    units = models.model_of(model).presentation.workshop
    return {_kind_with(unit, unit).unit: unit for unit in units}


def typed_units(study: Study, spec: Mapping[str, Any]) -> dict[str, str]:
    """The unit in which most quantities of each kind were typed, by SI unit; the first one where several tie.

    A zero, such as a phase of 0 deg, says little about units: it counts where nothing else of the kind was typed.
    """
    votes: dict[str, Counter[str]] = {}
    for si, text in _quantities(study, spec):
        if si == "1" and not isinstance(si, models.Share):
            continue
        number, unit = _typed_unit(text, si)
        if unit is not None:
            votes.setdefault(si, Counter())[unit] += _MUCH if number else 1
    return {si: counter.most_common(1)[0][0] for si, counter in votes.items()}


def typed_unit(text: str, si: str) -> str | None:
    """The unit of those offered in which a quantity of the SI unit was typed; None where none is its size."""
    return _typed_unit(text, si)[1]


def _typed_unit(text: str, si: str) -> tuple[Fraction, str | None]:
    """The number of a quantity, and its unit; an unknown unit, and text that is none, has no unit."""
    try:
        value, typed = split_quantity(text)
        size = _size(typed, si)
    except QuantityError:
        return Fraction(), None
    # A unit that is not offered, or is the SI unit of another kind, could not be told from others in a picture.
    units = (si, *_BY_UNIT[si].others) if si in _BY_UNIT else ()
    return value, next((unit for unit in units if _size(unit, si) == size), None)


def units_in(base: object) -> dict[str, str]:
    """The unit of each text of ``base`` that is a quantity, by path."""
    units = {}
    for path, text in _texts(base, ""):
        with suppress(QuantityError):
            units[path] = split_quantity(text)[1]
    return units


def _quantities(study: Study, spec: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Every text of a spec that may be a quantity, with the SI unit of its parameter or result."""
    for path, text in _texts(spec.get("base"), ""):
        yield unit_of(study, path), text
    for part in _named(spec):
        names = next(part[key] for key in _NAMING if key in part)
        name = names[0] if isinstance(names, list) and names else names
        if isinstance(name, str):
            info = result_of(models.study_results(study), name)
            si = unit_of(study, name) if info is None else info.unit
            for key, value in part.items():
                if key not in _NAMING:
                    yield from ((si, text) for _, text in _texts(value, key))


def _texts(value: object, path: str) -> Iterator[tuple[str, str]]:
    if isinstance(value, str):
        yield path, value
    elif isinstance(value, Mapping):
        for key, item in value.items():
            yield from _texts(item, f"{path}.{key}".removeprefix("."))
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from _texts(item, f"{path}.{index}".removeprefix("."))


def _named(value: object) -> Iterator[Mapping[str, Any]]:
    """Every part of a spec that names a parameter or a result."""
    if isinstance(value, Mapping):
        if any(key in value for key in _NAMING):
            yield value
            return
        for key, item in value.items():
            if key != "base":
                yield from _named(item)
    elif isinstance(value, list):
        for item in value:
            yield from _named(item)
