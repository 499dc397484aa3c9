"""A setting of the laboratory: a machine, the numbers that its sliders change, its start and its sketch."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import parse_qsl, urlencode

from sprag.sentences import Amount
from sprag.service.faults import Fault, shown
from sprag.service.figures.drawing import Drawing
from sprag.service.figures.drawings import drawings
from sprag.service.http.problems import ApiError
from sprag.service.http.views import preset_of
from sprag.service.http.web.figures.shaft import overridden
from sprag.service.http.web.form.entries import plain
from sprag.service.http.web.form.own_machine import OWN, case_page, machine_of, read_machine
from sprag.service.http.web.laboratory.sliders import Slider, faults_by_field, is_own, sliders_of, unit_of
from sprag.service.presets import preset_names
from sprag.service.reading.faults import message
from sprag.service.reading.limits import span
from sprag.service.reading.quantities import TYPED
from sprag.service.reading.reader import Choice, reading_for
from sprag.service.reading.units import QuantityError, parse_quantity
from sprag.service.reading.wording import words
from sprag.service.spec.document import parse_spec
from sprag.service.spec.report import SpecError
from sprag.worker import models
from sprag.worker.models.parameters import model_parameter

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sprag.worker.models.laboratory import Laboratory
    from sprag.worker.study import Study

_USUAL: Final = Choice(TYPED)


@dataclass(frozen=True, slots=True)
class Setting:
    """A machine with the numbers of a URL; ``faults``, by path, of invalid ones.

    ``machine`` is the machine as parameters of a URL, without what was changed; ``spec`` contains every number as
    given, valid or not. ``state`` are the initial values from which it starts, by path; ``freed`` is whether clutches
    start free because the machine cannot have the given states of its clutches. ``angle`` is that of the sketch, in
    degrees.
    """

    machine: tuple[tuple[str, str], ...]
    title: str
    spec: dict[str, Any]
    study: Study
    sliders: list[Slider]
    faults: dict[str, list[str]]
    warnings: tuple[str, ...]
    state: dict[str, str]
    freed: bool
    angle: float
    sketch: tuple[Drawing, ...]

    def groups(self, *, first: bool) -> dict[str, list[Slider]]:
        """The numbers that are always in sight, or the others, by their heading."""
        found: dict[str, list[Slider]] = {}
        for slider in self.sliders:
            if slider.first == first:
                found.setdefault(slider.group, []).append(slider)
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
        numbers = {slider.path: slider.text for slider in self.sliders if slider.first or slider.text != slider.own}
        angle = {"angle": f"{self.angle:g}"} if self.angle else {}
        return urlencode([*self.machine, *{**numbers, **self.state, **angle}.items()])


def laboratory_of(model: str) -> Laboratory:
    """The laboratory of a model."""
    return models.model_of(model).presentation.laboratory


@lru_cache(maxsize=8)
def machines(model: str) -> dict[str, str]:
    """Names and titles of the built-in machines of a model, without those that ask about others."""
    laboratory = laboratory_of(model)
    without, found = laboratory.without, dict[str, str]()
    for name in preset_names():
        preset = preset_of(name)
        if preset["spec"]["model"] == model and not name.startswith(without) and not set(without) & set(preset["spec"]):
            found[name] = words(name) if laboratory.by_name else preset["title"].partition(":")[0]
    return found


def setting(model: str, given: Mapping[str, str], choice: Choice = _USUAL) -> Setting:
    """The setting of a URL with sliders in its reader's units.

    Raises ApiError for an unknown machine, SelectionError for units that cannot be shown. With ``start=rest`` the
    initial values given do not count.
    """
    known, laboratory = machines(model), laboratory_of(model)
    machine = machine_of(given, given.get("machine") or next(iter(known), ""))
    spec, own = read_machine(machine, model, tuple(known))
    texts = {path: text.strip() for path, text in given.items() if text.strip() and path in own.base}
    # A field with the rounded text of the machine's own number leaves that number as it is.
    changed = {path: text for path, text in texts.items() if not is_own(text, own.base[path], unit_of(own, path))}
    state = {} if given.get("start") == "rest" else {
        path: text.strip() for path, text in given.items() if text.strip() and _is_state(own, path)
    }  # fmt: skip
    changed = {path: text for path, text in changed.items() if not _is_state(own, path)}
    study, faults, warnings = _read(spec, own, changed | state)
    freed = False
    if faults and any(path.endswith(laboratory.of_clutches) for path in state):
        # A changed clutch may not have the state in which the one before it was.
        kept = {path: text for path, text in state.items() if not path.endswith(laboratory.of_clutches)}
        study, faults, warnings = _read(spec, own, changed | kept)
        state, freed = kept, not faults
    angle = _angle(given.get("angle", ""), faults)
    sliders = sliders_of(own, study, texts, reading_for(own, spec, choice), choice)
    title = own.name if machine[0][1] == OWN else known.get(machine[0][1], own.name)
    made = overridden(spec, {path: plain(text) for path, text in (changed | state).items()})
    return Setting(
        machine, title, made, study, [slider for slider in sliders if not _is_state(own, slider.path)], faults,
        warnings, state, freed, angle, drawings(study, angle),
    )  # fmt: skip


def _is_state(own: Study, path: str) -> bool:
    """Whether ``path`` is an initial value from which the next setting starts."""
    place, _, name = path.rpartition(".")
    return (
        name in laboratory_of(own.model).states
        and any(other.startswith(f"{place}.") for other in own.base)
        and model_parameter(own.model, path) is not None
    )


def _read(
    spec: dict[str, Any], own: Study, values: Mapping[str, str]
) -> tuple[Study, dict[str, list[str]], tuple[str, ...]]:
    """The study with some numbers and its warnings, or the machine's own and the faults by path."""
    try:
        parsed = parse_spec(overridden(spec, {path: plain(text) for path, text in values.items()}))
    except SpecError as error:
        return own, faults_by_field(error, {*own.base, *values}, values), ()
    study = parsed.study
    unsettled = models.has_strobes(study) and not models.is_settled(study.run)
    return (models.settled_study(study) if unsettled else study), {}, parsed.warnings


def held_settings(model: str, queries: list[str]) -> list[Setting]:
    """The settings that are held beside the current one; ApiError where there are too many or one is invalid."""
    most = laboratory_of(model).held
    if len(queries) > most:
        raise ApiError("invalid-parameter", f"At most {most} machines can be held; got {len(queries)}.")
    found = [setting(model, dict(parse_qsl(query, max_num_fields=2000))) for query in queries]
    if any(held.faults for held in found):
        texts = [f"{path}: {text}" for held in found for path, texts in held.faults.items() for text in texts]
        raise ApiError("invalid-spec", f"A held machine is invalid: {'; '.join(texts)}.")
    return found


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
