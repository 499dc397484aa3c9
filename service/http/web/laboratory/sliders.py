"""Sliders of the laboratory: which numbers have one in sight, its range, and the place of its knob."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from sprag.service.http.web.form.machine import group_of, row_of
from sprag.service.languages import _
from sprag.service.reading.faults import message
from sprag.service.reading.numbers import in_language, parse_number
from sprag.service.reading.quantities import SI, read_units
from sprag.service.reading.units import QuantityError, has_unit, parse_quantity, split_quantity
from sprag.service.reading.wording import words
from sprag.worker import models
from sprag.worker.models.laboratory import SliderKind
from sprag.worker.models.parameters import parameter_of, placed

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sprag.service.reading.reader import Choice, Reading
    from sprag.service.spec.report import SpecError
    from sprag.worker.models import Parameter
    from sprag.worker.study import Study

#: A number without a slider in sight.
_OTHER: Final = SliderKind("")


@dataclass(frozen=True, slots=True)
class Slider:
    """One number that can be changed: its value as given, and the range of its slider (SI).

    Attributes
    ----------
    group : heading under which it stands
    text, own : as given, and as the machine has it
    low, high : equal where the number has a field only
    shown, factor : unit in which the slider moves and the SI value of one; "" for the unit of the number itself
    first : whether it is always in sight
    """

    path: str
    label: str
    group: str
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

    def written(self, value: float) -> str | float:
        """An SI value as it stands in a spec: in the slider's unit, where that is not of SI."""
        text = quantity_text(value, self.shown, self.factor)
        return text if self.shown else float(text)


def sliders_of(own: Study, study: Study, texts: dict[str, str], reading: Reading, choice: Choice) -> list[Slider]:
    """The sliders of all numbers as their reader reads them, in the order of the page: of the machine as it comes
    (``own``) and as it is set (``study``, ``texts``).
    """
    kinds = models.model_of(own.model).presentation.laboratory.sliders
    found = [(_kind(own, path), path) for path in own.base]

    def place(pair: tuple[int, str]) -> tuple[bool, int, int, str]:
        _rows, number, rest = row_of(own.model, pair[1])
        return pair[0] == len(kinds), number, pair[0], rest

    return [
        _slider(own, study, path, texts.get(path, ""), (*kinds, _OTHER)[kind], reading, choice)
        for kind, path in sorted(found, key=place)
    ]


def entry_of(study: Study, path: str) -> Parameter | None:
    """The parameter at a path, in its own unit."""
    entry = parameter_of(study, path)
    return None if entry is None else placed(entry, path)


def unit_of(study: Study, path: str) -> str:
    """The SI unit of a number; "" where it is no parameter."""
    entry = entry_of(study, path)
    return "" if entry is None else entry.unit


def _kind(study: Study, path: str) -> int:
    """Place of the kind of a slider among those of the model; their number for the other numbers."""
    kinds, rest = models.model_of(study.model).presentation.laboratory.sliders, row_of(study.model, path)[2]
    fitting = (
        place for place, kind in enumerate(kinds)
        if re.fullmatch(kind.path, rest) and (not kind.unit or (kind.unit == unit_of(study, path) and study.base[path]))
    )  # fmt: skip
    return next(fitting, len(kinds))


def _slider(
    own: Study, study: Study, path: str, text: str, kind: SliderKind, reading: Reading, choice: Choice
) -> Slider:
    entry, first, laboratory = entry_of(own, path), own.base[path], models.model_of(own.model).presentation.laboratory
    unit = "" if entry is None else entry.unit
    low, high = _ends(own, path, kind, entry)
    shown, factor = _scale(own, path, unit, reading, choice)
    given = quantity_text(first, shown, factor)
    label = _label(own, path, kind, reading)
    return Slider(
        path, label, kind.group if kind.label else group_of(own.model, path),
        kind.symbol or ("" if entry is None else entry.symbol), unit,
        _(kind.help) if kind.help else "" if entry is None else _(entry.help),
        value_of(text, unit, study.base[path]), given if is_own(text, first, unit) else text.strip(), given,
        low, high, (kind.logarithmic or kind is _OTHER) and low > 0.0, shown, factor,
        kind is not _OTHER or not laboratory.sliders,
    )  # fmt: skip


def _label(own: Study, path: str, kind: SliderKind, reading: Reading) -> str:
    laboratory, (rows, number, rest) = models.model_of(own.model).presentation.laboratory, row_of(own.model, path)
    name = path.rpartition(".")[2]
    label = _(kind.label or words(name)) if kind is not _OTHER or laboratory.numbered else reading.caption(path)
    for at, text in laboratory.numbered.items():
        found = re.match(rf"{re.escape(at)}\.(\d+)\.", rest)
        if found is not None:
            label = _(text, number=int(found[1]) + 1, label=label.lower())
    pendulum = re.match(r"(\w+)\.(\d+)\.", path)
    if rows is not None:
        return _(rows.title, number=number, label=label)
    several = (
        pendulum and sum(re.fullmatch(rf"{pendulum[1]}\.\d+\.{name}", other) is not None for other in own.base) > 1
    )
    if kind.label and pendulum and several:
        return _("{name} of pendulum {number}", name=label, number=pendulum[2])
    return label


def _ends(own: Study, path: str, kind: SliderKind, entry: Parameter | None) -> tuple[float, float]:
    value, laboratory = own.base[path], models.model_of(own.model).presentation.laboratory
    fixed = kind.ends or laboratory.angles.get(path.rpartition(".")[2])
    if entry is not None and entry.unit == "1" and not laboratory.sliders:  # a share, such as a damping ratio
        fixed = (entry.low, entry.high) if math.isfinite(entry.high - entry.low) else None
    if kind.beside:
        value = max(own.base.get(other, 0.0) for other in kind.beside)
    low, high = sorted((kind.low * value, kind.high * value)) if math.isfinite(value) else (0.0, 0.0)
    low, high = fixed or (low, max(high, kind.least))
    return (low, high) if entry is None else (max(low, entry.low), min(high, entry.high))


def _scale(own: Study, path: str, si: str, reading: Reading, choice: Choice) -> tuple[str, float]:
    """Unit in which a slider moves, "" for SI, and the SI value of one: the reader's choice or that of the model."""
    shown = reading.unit(si)
    if shown != si:
        return shown, parse_quantity(f"1 {shown}", si)
    for pattern, unit in (
        models.model_of(own.model).presentation.laboratory.shown_in if read_units(choice.units)[0] != SI else ()
    ):
        if re.fullmatch(pattern, path):
            try:
                return unit, parse_quantity(f"1 {unit}", si)
            except QuantityError:
                continue
    return "", 1.0


def is_own(text: str, own: float, si: str) -> bool:
    """Whether a text is the machine's own number (SI), rounded as a field has it in whatever unit; also "" is."""
    try:
        unit = split_quantity(text)[1] if text.strip() else ""
        return not text.strip() or text.strip() == quantity_text(
            own, unit, parse_quantity(f"1 {unit}", si) if unit else 1
        )
    except QuantityError:
        return False


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
