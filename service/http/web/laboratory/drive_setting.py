"""The setting of the laboratory of vibration drives: a machine, the numbers that its sliders change, and its start."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlencode

from sprag.service.http.problems import ApiError
from sprag.service.http.views import preset_of
from sprag.service.http.web.figures.shaft import overridden
from sprag.service.http.web.form.check import message
from sprag.service.http.web.form.entries import plain
from sprag.service.http.web.laboratory.sliders import Slider, quantity_text, value_of
from sprag.service.presets import preset_names
from sprag.service.results.wording import words
from sprag.service.spec.document import parse_spec
from sprag.service.spec.fields import coefficient_unit
from sprag.service.spec.report import SpecError
from sprag.worker import models
from sprag.worker.models.parameters import parameter_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

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
    "excitation.frequency": Range("Excitation", "Frequency", 0.5, 2.0),
    "excitation.amplitude_x": Range("Excitation", "Horizontal amplitude", 0.0, 2.5, 2e-3, unit="mm", size=1e-3),
    "excitation.amplitude_y": Range("Excitation", "Vertical amplitude", 0.0, 2.5, 2e-3, unit="mm", size=1e-3),
    "excitation.phase": Range("Excitation", "Phase of the vertical", 0.0, 0.0, unit="deg", size=math.pi / 180.0),
    "shaft.load": Range("Shaft", "Load torque", 0.0, 4.0, 1.0),
    "shaft.inertia": Range("Shaft", "Inertia", 0.1, 10.0, logarithmic=True),
    "backlash": Range("Clutch", "Backlash", 0.0, 5.0, 0.02),
    "clutch.coefficients.1": Range("Clutch", "Stiffness", 0.1, 10.0, logarithmic=True),
    "damping": Range("Pendulum", "Damping", 0.0, 5.0, 0.02),
    "inertia": Range("Pendulum", "Inertia", 0.5, 2.0, logarithmic=True),
    "spring_rate": Range("Pendulum", "Spring rate", 0.5, 2.0, logarithmic=True),
}
_STATE: Final = (".initial_angle", ".initial_speed", ".initial_windup", ".initial_clutch")
_OF_CLUTCH: Final = (".initial_windup", ".initial_clutch")


@dataclass(frozen=True, slots=True)
class Setting:
    """A drive with the numbers of a URL; ``faults``, by path, of invalid ones.

    ``further`` are the numbers without a slider as given, ``state`` the initial values from which it starts, both by
    path; ``freed`` is whether clutches start free because the drive cannot have the given states of its clutches.
    """

    name: str
    title: str
    spec: dict[str, Any]
    study: Study
    sliders: list[Slider]
    faults: dict[str, list[str]]
    further: dict[str, str]
    state: dict[str, str]
    freed: bool

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
        return urlencode([("machine", self.name), *numbers.items()])


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


def setting(given: Mapping[str, str]) -> Setting:
    """The setting of a URL; ApiError for an unknown machine.

    With ``start=rest`` the initial values given do not count.
    """
    name = given.get("machine") or next(iter(machines()), "")
    if name not in machines():
        raise ApiError("not-found", f"Unknown machine; known machines: {', '.join(machines()) or 'none'}.")
    spec, own = _own(name)
    texts = {path: given[path].strip() for path in (*own.base, *_states_of(own)) if given.get(path, "").strip()}
    state = {path: text for path, text in texts.items() if _is_state(path) and given.get("start") != "rest"}
    values = {path: text for path, text in texts.items() if not _is_state(path)}
    study, faults = _read(spec, own, values | state)
    freed = False
    if faults and any(path.endswith(_OF_CLUTCH) for path in state):
        # A changed clutch may not have the state in which the one before it was.
        kept = {path: text for path, text in state.items() if not path.endswith(_OF_CLUTCH)}
        study, faults = _read(spec, own, values | kept)
        state, freed = kept, not faults
    sliders = [_slider(own, study, path, values.get(path, "")) for path in _in_order(own.base)]
    slid = {slider.path for slider in sliders}
    further = {path: text for path, text in values.items() if path not in slid}
    changed = overridden(spec, {path: plain(text) for path, text in (values | state).items()})
    return Setting(name, title_of(name), changed, study, sliders, faults, further, state, freed)


@lru_cache
def _own(name: str) -> tuple[dict[str, Any], Study]:
    """The spec of a built-in drive as one case; what only an axis gives has the value in the middle of the axis."""
    spec: dict[str, Any] = preset_of(name)["spec"]
    middle = {path: axis.values[len(axis.values) // 2] for axis in parse_spec(spec).study.axes for path in axis.paths}
    single = overridden(spec, {path: value for path, value in middle.items() if not _gives(spec["base"], path)})
    return single, parse_spec(single).study


def _gives(base: Any, path: str) -> bool:
    """Whether the base of a spec has a number at a flat path."""
    for key in path.split("."):
        if isinstance(base, dict) and key not in base:
            return False
        base = base[int(key)] if isinstance(base, list) else base[key]
    return True


def _read(spec: dict[str, Any], own: Study, values: Mapping[str, str]) -> tuple[Study, dict[str, list[str]]]:
    """The study with some numbers, or the machine's own and the faults by path."""
    try:
        study = parse_spec(overridden(spec, {path: plain(text) for path, text in values.items()})).study
    except SpecError as error:
        faults: dict[str, list[str]] = {}
        for item in error.faults:
            path = (item.where or "").removeprefix("/base/").replace("/", ".")
            faults.setdefault(path if path in values else "", []).append(message(item))
        return own, faults
    return (study if models.is_settled(study.run) else models.settled_study(study)), {}


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


def _slider(own: Study, study: Study, path: str, text: str) -> Slider:
    kind = _RANGES[_kind(path)]
    entry = parameter_of(own, path)
    stiffness = "coefficients" in path
    unit = "" if entry is None else coefficient_unit(1) if stiffness else entry.unit
    low, high = _limits(own, path, kind)
    found = _PENDULUM.match(path)
    several = sum(other.endswith(f".{path.rsplit('.', 1)[-1]}") for other in own.base if _PENDULUM.match(other)) > 1
    given = quantity_text(own.base[path], kind.unit, kind.size)
    return Slider(
        path, f"{kind.label} of pendulum {found[1]}" if found and several else kind.label,
        "" if entry is None else "c2" if stiffness else entry.symbol, unit,
        "" if entry is None else "slope of the torque at small windup" if stiffness else entry.help,
        value_of(text, unit, study.base[path]), text or given, given, low, high, kind.logarithmic and low > 0.0,
        kind.unit, kind.size,
    )  # fmt: skip


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
    return kind.low * value, max(kind.high * value, kind.least)
