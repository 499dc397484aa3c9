"""Sliders of the laboratory: which numbers have one, its range, and the place of its knob."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from sprag.service.http.web.form.check import message
from sprag.service.http.web.form.machine import row_of
from sprag.service.languages import N_, _
from sprag.service.reading.numbers import in_language, parse_number
from sprag.service.reading.quantities import read_units
from sprag.service.reading.units import QuantityError, has_unit, parse_quantity, split_quantity
from sprag.service.reading.wording import words
from sprag.worker import models
from sprag.worker.models.parameters import parameter_of

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sprag.service.reading.reader import Choice, Reading
    from sprag.service.spec.report import SpecError
    from sprag.worker.study import Study

#: Numbers that every machine shows first, and the range of their sliders: (lower, upper) factor on the machine's own.
FIRST: Final = {"drive.inertia": (0.05, 20.0), "mean_speed": (0.25, 4.0), "operation.scale": (0.0, 3.0)}
_MASSES: Final = (0.0, 4.0)
_OTHERS: Final = (0.5, 2.0)
#: Units in which a slider moves unless its reader has chosen others, and the SI value of one.
_SHOWN: Final = {"rad": ("deg", math.pi / 180.0), "rad/s": ("rpm", math.pi / 30.0)}
_SI: Final = ("", 1.0)
#: Angles, in rad, whose sliders do not depend on the machine's own value.
_ANGLES: Final = {"crank_angle": (-2.0 * math.pi, 2.0 * math.pi), "inclination": (-math.pi, math.pi)}


@dataclass(frozen=True, slots=True)
class Slider:
    """One number that can be changed: its value as given, and the range of its slider (SI).

    Attributes
    ----------
    text, own : as given, and as the machine has it
    low, high : equal where the number has a field only
    shown, factor : unit in which the slider moves and the SI value of one; "" for the unit of the number itself
    first : whether it is always in sight
    """

    path: str
    label: str
    symbol: str
    unit: str
    help: str
    value: float
    text: str
    own: str
    low: float
    high: float
    logarithmic: bool
    shown: str = ""
    factor: float = 1.0
    first: bool = True

    @property
    def has_unit(self) -> bool:
        """Whether its text has a unit of its own."""
        return has_unit(self.text)


def slider_of(own: Study, study: Study, path: str, text: str, reading: Reading, choice: Choice) -> Slider:
    """The slider of a number, as its reader reads it: of the machine as it comes (``own``) and as it is set (``study``,
    ``text``).
    """
    entry = parameter_of(own, path)
    unit = "" if entry is None else entry.unit
    factors, is_first = _factors(own, path)
    first = own.base[path]
    low, high = sorted((factors[0] * first, factors[1] * first)) if math.isfinite(first) else (0.0, 0.0)
    low, high = _ANGLES.get(path.rsplit(".", 1)[-1], (low, high))
    if entry is not None:
        low, high = max(low, entry.low), min(high, entry.high)
    shown, factor = scale(unit, _SHOWN.get(unit, _SI), reading, choice)
    _rows, part, name = row_of(models.MACHINE_SHAFT, path)
    label = _("Load, as a multiple of the diagram") if name == "operation.scale" else _(words(path.rsplit(".", 1)[-1]))
    if name.startswith(("operation.steps.", "drive.stages.")):
        place = name.split(".")
        number = int(place[2]) + 1
        step = name.startswith("operation.")
        numbered = N_("Step {number}: {label}") if step else N_("Stage {number}: {label}")
        label = _(numbered, number=number, label=label.lower())
    given = quantity_text(first, shown, factor)
    typed = given if is_own(text, first, unit) else text.strip()
    return Slider(
        path, _("Part {number}: {label}", number=part, label=label) if part else label,
        "" if entry is None else entry.symbol, unit,
        "" if entry is None else _(entry.help), value_of(text, unit, study.base[path]), typed, given,
        low, high, low > 0.0, shown, factor, is_first,
    )  # fmt: skip


def scale(si: str, usual: tuple[str, float], reading: Reading, choice: Choice) -> tuple[str, float]:
    """Unit in which a slider moves, "" for SI, and the SI value of one: ``usual`` unless its reader has chosen."""
    shown = reading.unit(si)
    if shown != si:
        return shown, parse_quantity(f"1 {shown}", si)
    return usual if read_units(choice.units)[0] else _SI


def is_own(text: str, own: float, si: str) -> bool:
    """Whether a text is the machine's own number (SI), rounded as a field has it in whatever unit; also "" is."""
    try:
        unit = split_quantity(text)[1] if text.strip() else ""
        return not text.strip() or text.strip() == quantity_text(
            own, unit, parse_quantity(f"1 {unit}", si) if unit else 1
        )
    except QuantityError:
        return False


def _factors(study: Study, path: str) -> tuple[tuple[float, float], bool]:
    """Range of a slider as factors on the machine's own value, and whether it is always in sight."""
    own = row_of(models.MACHINE_SHAFT, path)[2]
    if own in FIRST:
        return FIRST[own], True
    entry = parameter_of(study, path)
    if own.startswith("mechanism.") and entry is not None and entry.unit == "kg" and study.base[path] > 0.0:
        return _MASSES, True
    return _OTHERS, False


def value_of(text: str, unit: str, otherwise: float) -> float:
    """The number (SI) of a text with or without a unit, even where the machine is invalid with it."""
    text = in_language(text)
    try:
        found = parse_quantity(text, unit) if split_quantity(text)[1] else parse_number(text.strip())
    except QuantityError:
        return otherwise
    return otherwise if found is None or not math.isfinite(found) else found


def quantity_text(value: float, shown: str = "", factor: float = 1.0) -> str:
    """A number for a field, with the unit in which its slider moves."""
    if not math.isfinite(value):
        return ""
    return f"{value / factor:.6g} {shown}" if shown else f"{value:.6g}"


def position(slider: Slider) -> float:
    """Position of a slider, 0 to 1000."""
    span = slider.high - slider.low
    if slider.logarithmic and span:
        value = max(slider.value, slider.low)
        return 1000.0 * math.log(value / slider.low) / math.log(slider.high / slider.low)
    return 1000.0 * (slider.value - slider.low) / span if span else 0.0


def in_order(sliders: list[Slider]) -> list[Slider]:
    """The sliders as they stand on the page: the machine's own first, then those of each part."""
    order = list(FIRST)

    def place(slider: Slider) -> tuple[bool, int, bool, str]:
        _rows, part, own = row_of(models.MACHINE_SHAFT, slider.path)
        return not slider.first, part, own not in order, own

    return sorted(sliders, key=place)


def faults_by_field(error: SpecError, fields: Iterable[str], changed: Iterable[str]) -> dict[str, list[str]]:
    """The faults of a machine by the path of the field beside which they are shown, "" for none.

    A fault of a whole part of the machine, such as links that do not reach each other, is shown beside every number
    of that part that was changed.
    """
    known, found = set(fields), dict[str, list[str]]()
    for item in error.faults:
        path = (item.where or "").removeprefix("/base/").replace("/", ".")
        inside = [own for own in changed if own in known and own.startswith(f"{path}.")]
        for place in [path] if path in known else inside or [""]:
            found.setdefault(place, []).append(message(item))
    return found
