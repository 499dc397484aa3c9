"""The run of a spec: until settled or for a given time, tolerance, interpretation of equation (5)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from sprag_study.sentences import Amount, Sentence, plural
from sprag_study.service.languages import N_
from sprag_study.service.reading.units import (
    PERIOD_NAMES,
    QuantityError,
    exact_number,
    parse_exact,
    split_quantity,
    to_float,
)
from sprag_study.service.spec.described import ANY_RUN, DURATION, SETTLED_RUN, Record
from sprag_study.service.spec.lists import refuse_mixed
from sprag_study.worker.limits import MAX_RUN_PERIODS
from sprag_study.worker.models import MEANS_FROM_PERIODS
from sprag_study.worker.models.common import LOADS

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from sprag_study.service.spec.node import Node

#: Fields of settled runs only, and of timed runs only.
SETTLED_FIELDS: Final = tuple(SETTLED_RUN)
TIMED_FIELDS: Final = ("duration", "window")
_RUN: Final = Record(
    {
        **SETTLED_RUN,
        "duration": DURATION,
        "window": {
            "type": "array",
            "minItems": 2,
            "maxItems": 2,
            "items": replace(DURATION, help="a time of the run").schema(),
            "description": "part of the run that is evaluated, [start, end]; by default the last third",
        },
        **ANY_RUN,
    },
    "how long each case runs, what is evaluated, how accurately",
)
#: JSON Schema of `run`: it lasts until it is settled or for a given time.
RUN: Final = {
    **_RUN.schema(),
    "not": {"allOf": [{"anyOf": [{"required": [name]} for name in names]} for names in (TIMED_FIELDS, SETTLED_FIELDS)]},
}
_ANY_DEFAULTS: Final[dict[str, Any]] = {name: field.default for name, field in ANY_RUN.items() if name != LOADS}
#: Defaults of missing fields. A run without a field of `TIMED_FIELDS` lasts until it is settled.
SETTLED_DEFAULTS: Final[dict[str, Any]] = {name: field.default for name, field in SETTLED_RUN.items()} | _ANY_DEFAULTS
TIMED_DEFAULTS: Final[dict[str, Any]] = {"duration": [60.0, "periods"], "window": None, **_ANY_DEFAULTS}
_TIME: Final = N_('seconds (2.0 or "2 s") or excitation periods ("60 periods")')
_MAX_SECONDS: Final = 1e9
#: Ends that are equal but for the rounding of a conversion between seconds and periods count as equal.
_ROUNDING: Final = 1e-9

Time = list[Any]  # [number, "periods" | "s"], as stored in a study


def read_run(node: Node, frequencies: NDArray[np.float64]) -> dict[str, Any]:
    """Read the run as stored in a study (see `Study.run`); faults are recorded.

    Parameters
    ----------
    frequencies : every excitation frequency (Hz) of the study; empty when they could not be read
    """
    if node.given and not _RUN.read(node, null=False):
        return dict(SETTLED_DEFAULTS)
    settled = not any(name in node for name in TIMED_FIELDS)
    run = dict(SETTLED_DEFAULTS if settled else TIMED_DEFAULTS)
    start = node["duration"]
    run |= {name: field.read(node) for name, field in ((SETTLED_RUN | ANY_RUN) if settled else ANY_RUN).items()}
    if not run[LOADS]:
        del run[LOADS]  # studies of before the field existed are the same ones
    if settled:
        _warn_of_few_periods(node["at_most"], run["at_most"])
        return run
    _refuse_settled(node)
    if start.given:
        run["duration"] = _read_time(start, positive=True)
    if "window" in node:
        run["window"] = _read_window(node["window"])
    if start.sound and frequencies.size:
        _check_times(node, run, frequencies)
    return run


def refuse_run(node: Node, why: str = N_("is not used: this model has no run")) -> dict[str, Any]:
    """The empty run of a model without a run; every given field is recorded as a fault."""
    if node.given and not isinstance(node.value, Mapping):
        node.refuse("wrong-type", "must be an object", allowed="nothing, or an empty object: this model has no run")
    else:
        for field in node.parts():
            field.refuse("not-used", why, allowed="no `run`")
    return {}


def _warn_of_few_periods(node: Node, at_most: int | None) -> None:
    if at_most is not None and at_most < MEANS_FROM_PERIODS:
        text = plural(
            "{count} periods are too few for the means of irregular motion, which takes {needed}: cases without a "
            "periodic motion will be unsettled",
            "{count} periods are too few for the means of irregular motion, which takes {needed}: cases without a "
            "periodic motion will be unsettled",
            at_most,
            needed=MEANS_FROM_PERIODS,
        )
        node.report.warn("short-search", node.pointer, text)


def _refuse_settled(run: Node) -> None:
    """Record the fields that contradict a duration or a window."""
    given = [f"`{name}`" for name in TIMED_FIELDS if name in run]
    timed = Sentence("{low} and {high}", low=given[0], high=given[1]) if len(given) == 2 else given[0]
    for name in SETTLED_FIELDS:
        if name in run:
            run[name].refuse(
                "conflict", Sentence("contradicts {fields}: a run lasts until it is settled or for a given time",
                                     fields=timed),
                allowed=Sentence("no `{field}`, or neither `duration` nor `window`", field=name),
            )  # fmt: skip


def in_periods(time: Time, frequency: float) -> float:
    """A time of a run in excitation periods at ``frequency`` (Hz)."""
    return float(time[0]) if time[1] == "periods" else float(time[0]) * frequency


def time_text(time: Time) -> str:
    """A time of a run as a user would write it."""
    return f"{time[0]:g} {time[1]}"


def _read_time(node: Node, *, positive: bool = False) -> Time | None:
    allowed = Sentence("{range}, in {units}", range="> 0" if positive else ">= 0", units=Sentence(_TIME))
    time = node.parsed(_time, allowed=allowed)
    if time is not None and (time[0] < 0.0 or (positive and time[0] == 0.0) or time[0] > _MAX_SECONDS):
        node.refuse("out-of-range", "is out of range", allowed=allowed)
        return None
    return time


def _time(value: object) -> Time:
    """A number of seconds, or a text with periods or a unit of time; raises QuantityError."""
    if not isinstance(value, str):
        return [to_float(exact_number(value, "s")) + 0.0, "s"]
    number, unit = split_quantity(value)
    if not unit:
        raise QuantityError("missing-unit", "a text needs its unit: periods or s")
    if unit in PERIOD_NAMES:
        return [to_float(number) + 0.0, "periods"]
    return [to_float(parse_exact(value, "s")) + 0.0, "s"]


def _read_window(node: Node) -> list[Time] | None:
    if not isinstance(node.value, list) or len(node.value) != 2:
        node.refuse(
            "wrong-type", "must be a list of its start and its end",
            allowed='a list of two times in seconds or excitation periods, such as ["20 periods", "40 periods"]',
        )  # fmt: skip
        return None
    if refuse_mixed(node.parts(), "s"):
        return None
    times = [_read_time(item) for item in node.parts()]
    return None if None in times else [time for time in times if time is not None]


def _check_times(node: Node, run: Mapping[str, Any], frequencies: NDArray[np.float64]) -> None:
    """Compare duration and window at the lowest and the highest frequency; in between both are linear."""
    for frequency in dict.fromkeys((float(frequencies.min()), float(frequencies.max()))):
        duration = in_periods(run["duration"], frequency)
        if duration > MAX_RUN_PERIODS:
            periods = {"periods": Amount(duration, digits=8), "frequency": Amount(frequency, "Hz", 6)}
            node["duration"].refuse(
                "out-of-range", Sentence("is {periods} excitation periods at {frequency}", **periods),
                allowed=Sentence("at most {periods} periods in any case", periods=int(MAX_RUN_PERIODS)),
            )  # fmt: skip
            return
        if run["window"] is None:
            if duration / 3.0 < 1.0 - _ROUNDING:
                text = N_(
                    "the window, its last third, is shorter than one excitation period at {frequency} ({count} "
                    "periods), so means over it depend on its position"
                )
                _warn_of_short_window(node["duration"], text, frequency, duration / 3.0)
        elif not _check_window(node["window"], run, frequency):
            return


def _check_window(node: Node, run: Mapping[str, Any], frequency: float) -> bool:
    """Whether the window fits into the run at a frequency; a fault recorded where it does not."""
    at = Sentence("") if _one_unit(run) else Sentence(" at {frequency}", frequency=Amount(frequency, "Hz", 6))
    start, end = (in_periods(time, frequency) for time in run["window"])
    if not start < end * (1.0 - _ROUNDING):
        node.refuse("invalid-range", Sentence("starts at or after its end{at}", at=at), allowed="start < end")
        return False
    if end > in_periods(run["duration"], frequency) * (1.0 + _ROUNDING):
        node[1].refuse("out-of-range", Sentence("the window ends after the run{at}", at=at),
                       allowed=Sentence("at most the duration, {time}", time=time_text(run["duration"])))  # fmt: skip
        return False
    if end - start < 1.0 - _ROUNDING:
        text = N_(
            "shorter than one excitation period at {frequency} ({count} periods), so means over it depend on its "
            "position"
        )
        _warn_of_short_window(node, text, frequency, end - start)
    return True


def _warn_of_short_window(node: Node, text: str, frequency: float, count: float) -> None:
    values = {"frequency": Amount(frequency, "Hz", 6), "count": Amount(count, digits=3)}
    node.report.warn("short-window", node.pointer, Sentence(text, **values))


def _one_unit(run: Mapping[str, Any]) -> bool:
    return len({time[1] for time in (run["duration"], *(run["window"] or ()))}) == 1
