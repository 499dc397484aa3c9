"""A setting of the laboratory: a machine with the numbers of an address, its sliders and its sketch."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import parse_qsl, urlencode

from sprag.sentences import Amount
from sprag.service.faults import Fault, shown
from sprag.service.http.problems import ApiError
from sprag.service.http.views import preset_of
from sprag.service.http.web.figures.shaft import overridden
from sprag.service.http.web.form.check import message
from sprag.service.http.web.form.entries import plain
from sprag.service.http.web.form.machine import group_of
from sprag.service.http.web.form.own_machine import case_page, machine_of, read_machine
from sprag.service.http.web.laboratory.sliders import Slider, faults_by_field, in_order, is_own, slider_of
from sprag.service.presets import preset_names
from sprag.service.reading.limits import span
from sprag.service.reading.quantities import TYPED
from sprag.service.reading.reader import Choice, reading_for
from sprag.service.reading.units import QuantityError, parse_quantity
from sprag.service.results.figures.linkage import Drawing, drawings
from sprag.service.spec.document import parse_spec
from sprag.service.spec.report import SpecError
from sprag.worker import models
from sprag.worker.models.parameters import parameter_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sprag.worker.study import Study

_QUESTION: Final = "question_"
_USUAL: Final = Choice(TYPED)
#: Settings that can be held beside the current one.
MOST_HELD: Final = 3


@dataclass(frozen=True, slots=True)
class Setting:
    """A machine with the numbers of a URL; ``faults``, by path, of invalid ones.

    ``machine`` is the machine as parameters of a URL, without what was changed; ``spec`` contains every number as
    given, valid or not; ``angle`` is that of the sketch, in degrees.
    """

    machine: tuple[tuple[str, str], ...]
    spec: dict[str, Any]
    study: Study
    sliders: list[Slider]
    faults: dict[str, list[str]]
    angle: float
    sketch: tuple[Drawing, ...]

    @property
    def first(self) -> list[Slider]:
        """The numbers that are always in sight."""
        return [slider for slider in self.sliders if slider.first]

    @property
    def groups(self) -> dict[str, list[Slider]]:
        """The other numbers, by their heading."""
        found: dict[str, list[Slider]] = {}
        for slider in self.sliders:
            if not slider.first:
                found.setdefault(group_of(models.MACHINE_SHAFT, slider.path), []).append(slider)
        return found

    @property
    def degrees(self) -> int:
        """Degrees of a cycle of the shaft."""
        return 360 * int((self.study.structure or {}).get("cycle", 1))

    @property
    def name(self) -> str:
        """Name of the machine."""
        return self.machine[0][1]

    @property
    def case(self) -> str:
        """Page of the case that the machine comes from; "" where it comes from none."""
        return case_page(dict(self.machine).get("case", ""))

    @property
    def changed(self) -> list[Slider]:
        """The numbers that are not the machine's own."""
        return [slider for slider in self.sliders if slider.text != slider.own]

    @property
    def query(self) -> str:
        """The setting as parameters of a URL."""
        numbers = [(s.path, s.text) for s in self.sliders if s.first or s.text != s.own]
        return urlencode([*self.machine, *numbers, *([("angle", f"{self.angle:g}")] if self.angle else [])])


@lru_cache(maxsize=1)
def machines() -> tuple[str, ...]:
    """Names of the built-in machines, including those of the questions."""
    shafts = (name for name in preset_names() if preset_of(name)["spec"]["model"] == models.MACHINE_SHAFT)
    return tuple(name for name in shafts if not name.startswith(_QUESTION))


def setting(given: Mapping[str, str], choice: Choice = _USUAL) -> Setting:
    """The setting of a URL with sliders in its reader's units.

    Raises ApiError for an unknown machine, SelectionError for units that cannot be shown.
    """
    machine = machine_of(given, given.get("machine") or next(iter(machines()), ""))
    spec, own = read_machine(machine, models.MACHINE_SHAFT, machines())
    # A field with the rounded text of the machine's own number leaves that number as it is.
    texts = {path: given[path] for path in own.base if given.get(path, "").strip()}
    values = {path: plain(text) for path, text in texts.items() if not is_own(text, own.base[path], _unit(own, path))}
    faults: dict[str, list[str]] = {}
    try:
        study = parse_spec(overridden(spec, values)).study
    except SpecError as error:
        study, faults = own, faults_by_field(error, own.base, values)
    angle = _angle(given.get("angle", ""), faults)
    reading = reading_for(own, spec, choice)
    sliders = in_order([slider_of(own, study, path, given.get(path, ""), reading, choice) for path in own.base])
    made = overridden(spec, values)
    return Setting(machine, made, study, sliders, faults, angle, drawings(study, angle))


def held_settings(queries: list[str]) -> list[Setting]:
    """The settings that are held beside the current one; ApiError where there are too many or one is invalid."""
    if len(queries) > MOST_HELD:
        raise ApiError("invalid-parameter", f"At most {MOST_HELD} machines can be held; got {len(queries)}.")
    found = [setting(dict(parse_qsl(query, max_num_fields=2000))) for query in queries]
    if any(held.faults for held in found):
        texts = [f"{path}: {text}" for held in found for path, texts in held.faults.items() for text in texts]
        raise ApiError("invalid-spec", f"A held machine is invalid: {'; '.join(texts)}.")
    return found


def _unit(own: Study, path: str) -> str:
    entry = parameter_of(own, path)
    return "" if entry is None else entry.unit


def _angle(text: str, faults: dict[str, list[str]]) -> float:
    """The angle of the sketch in degrees; 0 where it is not one."""
    if not text.strip():
        return 0.0
    value = plain(text)
    try:
        found = float(value) if isinstance(value, int | float) else math.degrees(parse_quantity(value, "rad"))
    except QuantityError as error:
        faults["angle"] = [
            message(Fault("/angle", error.code, error.message, shown(value), allowed="an angle in degrees"))
        ]
        return 0.0
    if abs(found) > 1e6:
        allowed = span("-1000000", Amount(1000000, "deg", form="d"))
        faults["angle"] = [message(Fault("/angle", "out-of-range", "out of range", f"{found:g}", allowed=allowed))]
        return 0.0
    return found
