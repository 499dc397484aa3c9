"""The setting of the laboratory of vibration drives: a machine, the numbers that its sliders change, and its start."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlencode

from sprag.service.http.views import preset_of
from sprag.service.http.web.figures.shaft import overridden
from sprag.service.http.web.form.entries import plain
from sprag.service.http.web.form.own_machine import OWN, case_page, machine_of, read_machine
from sprag.service.http.web.laboratory.sliders import Slider, faults_by_field, is_own, quantity_text, scale, value_of
from sprag.service.languages import N_, _
from sprag.service.presets import preset_names
from sprag.service.reading.quantities import TYPED
from sprag.service.reading.reader import Choice, reading_for
from sprag.service.reading.wording import words
from sprag.service.spec.document import parse_spec
from sprag.service.spec.report import SpecError
from sprag.worker import models
from sprag.worker.models.parameters import coefficient_unit, parameter_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from sprag.service.reading.reader import Reading
    from sprag.worker.study import Study

_PENDULUM: Final = re.compile(r"pendulums\.(\d+)\.")
#: Presets whose spec says how it chooses its cases show the rig of another preset.
_OWN_CHOICE: Final = ("refine", "goal")


@dataclass(frozen=True, slots=True)
class Range:
    """The range of a slider: factors on the machine's own value (SI), at least up to ``least``.

    ``unit`` is the unit of its numbers where it is not that of SI, and ``size`` one of it in SI.
    """

    group: str
    label: str
    low: float
    high: float
    least: float = 0.0
    logarithmic: bool = False
    unit: str = ""
    size: float = 1.0


#: Parameters that have a slider, by the end of their path, in the order of the page.
_RANGES: Final[dict[str, Range]] = {
    "excitation.frequency": Range(N_("Excitation"), N_("Frequency"), 0.5, 2.0),
    "excitation.amplitude_x": Range(N_("Excitation"), N_("Horizontal amplitude"), 0.0, 2.5, 2e-3, unit="mm", size=1e-3),
    "excitation.amplitude_y": Range(N_("Excitation"), N_("Vertical amplitude"), 0.0, 2.5, 2e-3, unit="mm", size=1e-3),
    "excitation.phase": Range(
        N_("Excitation"), N_("Phase of the vertical"), 0.0, 0.0, unit="deg", size=math.pi / 180.0
    ),
    "shaft.load": Range(N_("Shaft"), N_("Load torque"), 0.0, 4.0, 1.0),
    "shaft.inertia": Range(N_("Shaft"), N_("Inertia"), 0.1, 10.0, logarithmic=True),
    "backlash": Range(N_("Clutch"), N_("Backlash"), 0.0, 5.0, 0.02),
    "clutch.coefficients.1": Range(N_("Clutch"), N_("Stiffness"), 0.1, 10.0, logarithmic=True),
    "damping": Range(N_("Pendulum"), N_("Damping"), 0.0, 5.0, 0.02),
    "mass": Range(N_("Pendulum"), N_("Mass"), 0.0, 2.0),
    "arm": Range(N_("Pendulum"), N_("Arm"), 0.0, 2.0, unit="mm", size=1e-3),
    "inertia": Range(N_("Pendulum"), N_("Inertia"), 0.5, 2.0, logarithmic=True),
    "spring_rate": Range(N_("Pendulum"), N_("Spring rate"), 0.5, 2.0, logarithmic=True),
}
_USUAL: Final = Choice(TYPED)
_STATE: Final = (".initial_angle", ".initial_speed", ".initial_windup", ".initial_clutch")
_OF_CLUTCH: Final = (".initial_windup", ".initial_clutch")


@dataclass(frozen=True, slots=True)
class Setting:
    """A drive with the numbers of a URL; ``faults``, by path, of invalid ones.

    ``machine`` is the drive as parameters of a URL, without what was changed. ``further`` are the numbers without a
    slider as given, ``state`` the initial values from which it starts, both by path; ``freed`` is whether clutches
    start free because the drive cannot have the given states of its clutches.
    """

    machine: tuple[tuple[str, str], ...]
    title: str
    spec: dict[str, Any]
    study: Study
    sliders: list[Slider]
    faults: dict[str, list[str]]
    warnings: tuple[str, ...]
    further: dict[str, str]
    state: dict[str, str]
    freed: bool

    @property
    def name(self) -> str:
        """Name of the drive."""
        return self.machine[0][1]

    @property
    def case(self) -> str:
        """Page of the case that the drive comes from; "" where it comes from none."""
        return case_page(dict(self.machine).get("case", ""))

    @property
    def groups(self) -> dict[str, list[Slider]]:
        """The sliders by heading."""
        found: dict[str, list[Slider]] = {}
        for slider in self.sliders:
            found.setdefault(_RANGES[_kind(slider.path)].group, []).append(slider)
        return found

    @property
    def query(self) -> str:
        """The setting as parameters of a URL."""
        numbers = {slider.path: slider.text for slider in self.sliders} | self.further | self.state
        return urlencode([*self.machine, *numbers.items()])


@lru_cache(maxsize=1)
def machines() -> tuple[str, ...]:
    """Names of the built-in drives."""
    specs = {name: preset_of(name)["spec"] for name in preset_names()}
    return tuple(
        name
        for name, spec in specs.items()
        if spec["model"] == models.VIBRATION_DRIVE and not any(key in spec for key in _OWN_CHOICE)
    )


def title_of(name: str) -> str:
    """Title of a built-in drive."""
    return words(name)


def setting(given: Mapping[str, str], choice: Choice = _USUAL) -> Setting:
    """The setting of a URL with sliders in its reader's units.

    Raises ApiError for an unknown machine, SelectionError for units that cannot be shown.
    With ``start=rest`` the initial values given do not count.
    """
    machine = machine_of(given, given.get("machine") or next(iter(machines()), ""))
    spec, own = read_machine(machine, models.VIBRATION_DRIVE, machines())
    texts = {path: given[path].strip() for path in (*own.base, *_states_of(own)) if given.get(path, "").strip()}
    state = {path: text for path, text in texts.items() if _is_state(path) and given.get("start") != "rest"}
    values = {path: text for path, text in texts.items() if not _is_state(path)}
    # A field with the rounded text of the drive's own number leaves that number as it is.
    changed = {
        path: text
        for path, text in values.items()
        if not _kind(path) or not is_own(text, own.base[path], _unit(own, path))
    }
    study, faults, warnings = _read(spec, own, changed | state)
    freed = False
    if faults and any(path.endswith(_OF_CLUTCH) for path in state):
        # A changed clutch may not have the state in which the one before it was.
        kept = {path: text for path, text in state.items() if not path.endswith(_OF_CLUTCH)}
        study, faults, warnings = _read(spec, own, changed | kept)
        state, freed = kept, not faults
    reading = reading_for(own, spec, choice)
    sliders = [_slider(own, study, path, values.get(path, ""), reading, choice) for path in _in_order(own.base)]
    slid = {slider.path for slider in sliders}
    further = {path: text for path, text in values.items() if path not in slid}
    title = own.name if machine[0][1] == OWN else title_of(machine[0][1])
    made = overridden(spec, {path: plain(text) for path, text in (changed | state).items()})
    return Setting(machine, title, made, study, sliders, faults, warnings, further, state, freed)


def _read(
    spec: dict[str, Any], own: Study, values: Mapping[str, str]
) -> tuple[Study, dict[str, list[str]], tuple[str, ...]]:
    """The study with some numbers and its warnings, or the machine's own and the faults by path."""
    try:
        parsed = parse_spec(overridden(spec, {path: plain(text) for path, text in values.items()}))
    except SpecError as error:
        return own, faults_by_field(error, values, values), ()
    study = parsed.study
    return (study if models.is_settled(study.run) else models.settled_study(study)), {}, parsed.warnings


def _is_state(path: str) -> bool:
    return path.endswith(_STATE)


def _states_of(study: Study) -> list[str]:
    """Paths of the initial values of a drive."""
    numbers = sorted({match[1] for path in study.base if (match := _PENDULUM.match(path))}, key=int)
    return ["shaft.initial_speed", *(f"pendulums.{k}{name}" for k in numbers for name in _STATE)]


def _kind(path: str) -> str:
    """The key of ``_RANGES`` of a path; "" where it has no slider."""
    return next((end for end in _RANGES if path == end or _PENDULUM.sub("", path, 1) == end), "")


def _in_order(paths: Iterable[str]) -> list[str]:
    """The paths that have a slider, in the order of the page."""
    order = list(_RANGES)
    return sorted((path for path in paths if _kind(path)), key=lambda path: (order.index(_kind(path)), path))


def _slider(own: Study, study: Study, path: str, text: str, reading: Reading, choice: Choice) -> Slider:
    kind = _RANGES[_kind(path)]
    entry = parameter_of(own, path)
    stiffness = "coefficients" in path
    unit = _unit(own, path)
    shown, factor = scale(unit, (kind.unit, kind.size), reading, choice)
    low, high = _limits(own, path, kind)
    found = _PENDULUM.match(path)
    several = sum(other.endswith(f".{path.rsplit('.', 1)[-1]}") for other in own.base if _PENDULUM.match(other)) > 1
    given, label = quantity_text(own.base[path], shown, factor), _(kind.label)
    typed = given if is_own(text, own.base[path], unit) else text
    if found and several:
        label = _("{name} of pendulum {number}", name=label, number=found[1])
    return Slider(
        path, label,
        "" if entry is None else "c2" if stiffness else entry.symbol, unit,
        "" if entry is None else _("slope of the torque at small windup") if stiffness else _(entry.help),
        value_of(text, unit, study.base[path]), typed, given, low, high, kind.logarithmic and low > 0.0,
        shown, factor,
    )  # fmt: skip


def _unit(own: Study, path: str) -> str:
    entry = parameter_of(own, path)
    return "" if entry is None else coefficient_unit(1) if "coefficients" in path else entry.unit


def written(slider: Slider, value: float) -> str | float:
    """An SI value as it stands in a spec: in the slider's unit, where that is not of SI."""
    text = quantity_text(value, slider.shown, slider.factor)
    return text if slider.shown else float(text)


def _limits(own: Study, path: str, kind: Range) -> tuple[float, float]:
    if path == "excitation.phase":
        return -math.pi, math.pi
    value = own.base[path]
    if path.startswith("excitation.amplitude_"):
        value = max(own.base.get(f"excitation.amplitude_{way}", 0.0) for way in "xy")
    low, high = sorted((kind.low * value, kind.high * value))
    return low, max(high, kind.least)
