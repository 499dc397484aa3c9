"""The run of a spec: until settled or for a given time, tolerance, interpretation of equation (5)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from sprag.sentences import Amount, Sentence, plural
from sprag.service.languages import N_
from sprag.service.reading.units import PERIOD_NAMES, QuantityError, exact_number, parse_exact, split_quantity, to_float
from sprag.service.spec.described import ANY_RUN, SETTLED_RUN
from sprag.service.spec.fields import nodes, read_object
from sprag.service.spec.lists import refuse_mixed
from sprag.service.spec.node import Node
from sprag.service.spec.report import Report, join
from sprag.worker.limits import MAX_RUN_PERIODS
from sprag.worker.models import MEANS_FROM_PERIODS

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

#: Fields of settled runs only, and of timed runs only.
SETTLED_FIELDS: Final = tuple(SETTLED_RUN)
TIMED_FIELDS: Final = ("duration", "window")
FIELDS: Final = (*SETTLED_FIELDS, *TIMED_FIELDS, *ANY_RUN)
_ANY_DEFAULTS: Final[dict[str, Any]] = {name: field.default for name, field in ANY_RUN.items()}
#: Defaults of missing fields. A run without a field of `TIMED_FIELDS` lasts until it is settled.
SETTLED_DEFAULTS: Final[dict[str, Any]] = {name: field.default for name, field in SETTLED_RUN.items()} | _ANY_DEFAULTS
TIMED_DEFAULTS: Final[dict[str, Any]] = {"duration": [60.0, "periods"], "window": None, **_ANY_DEFAULTS}
_TIME: Final = N_('seconds (2.0 or "2 s") or excitation periods ("60 periods")')
_MAX_SECONDS: Final = 1e9
#: Ends that are equal but for the rounding of a conversion between seconds and periods count as equal.
_ROUNDING: Final = 1e-9

Time = list[Any]  # [number, "periods" | "s"], as stored in a study


def read_run(report: Report, data: object, frequencies: NDArray[np.float64]) -> dict[str, Any]:
    """Read the run as stored in a study (see `Study.run`); faults are recorded in ``report``.

    Parameters
    ----------
    frequencies : every excitation frequency (Hz) of the study; empty when they could not be read
    """
    found = read_object(report, "/run", data, FIELDS, given=True)
    if found is None:
        return dict(SETTLED_DEFAULTS)
    settled = not any(name in found for name in TIMED_FIELDS)
    run = dict(SETTLED_DEFAULTS if settled else TIMED_DEFAULTS)
    before = report.found
    for name, field in ((SETTLED_RUN | ANY_RUN) if settled else ANY_RUN).items():
        run[name] = field.read(Node(report, "/run", found))
    if settled:
        _warn_of_few_periods(report, run["at_most"])
        return run
    _refuse_settled(report, found)
    if "duration" in found:
        run["duration"] = _read_time(report, "/run/duration", found["duration"], positive=True)
    if "window" in found:
        run["window"] = _read_window(report, found["window"])
    if report.found == before and frequencies.size:
        _check_times(report, run, found, frequencies)
    return run


def refuse_run(report: Report, data: object, why: str = N_("is not used: this model has no run")) -> dict[str, Any]:
    """The empty run of a model without a run; every given field is recorded as a fault."""
    if not isinstance(data, Mapping):
        report.fault(
            "/run",
            "wrong-type",
            "must be an object",
            data,
            allowed="nothing, or an empty object: this model has no run",
        )
        return {}
    for name, value in data.items():
        report.fault(join("/run", name), "not-used", why, value, allowed="no `run`")
    return {}


def _warn_of_few_periods(report: Report, at_most: int | None) -> None:
    if at_most is not None and at_most < MEANS_FROM_PERIODS:
        report.warn(
            "short-search",
            "/run/at_most",
            plural(
                "{count} periods are too few for the means of irregular motion, which takes {needed}: cases without a "
                "periodic motion will be unsettled",
                "{count} periods are too few for the means of irregular motion, which takes {needed}: cases without a "
                "periodic motion will be unsettled",
                at_most,
                needed=MEANS_FROM_PERIODS,
            ),
        )


def _refuse_settled(report: Report, found: Mapping[str, Any]) -> None:
    """Record the fields that contradict a duration or a window."""
    given = [f"`{name}`" for name in TIMED_FIELDS if name in found]
    timed = Sentence("{low} and {high}", low=given[0], high=given[1]) if len(given) == 2 else given[0]
    for name in SETTLED_FIELDS:
        if name in found:
            report.fault(
                f"/run/{name}",
                "conflict",
                Sentence("contradicts {fields}: a run lasts until it is settled or for a given time", fields=timed),
                found[name],
                allowed=Sentence("no `{field}`, or neither `duration` nor `window`", field=name),
            )


def in_periods(time: Time, frequency: float) -> float:
    """A time of a run in excitation periods at ``frequency`` (Hz)."""
    return float(time[0]) if time[1] == "periods" else float(time[0]) * frequency


def time_text(time: Time) -> str:
    """A time of a run as a user would write it."""
    return f"{time[0]:g} {time[1]}"


def _read_time(report: Report, pointer: str, value: object, *, positive: bool = False) -> Time | None:
    allowed = Sentence("{range}, in {units}", range="> 0" if positive else ">= 0", units=Sentence(_TIME))
    try:
        unit = "s"
        if isinstance(value, str):
            number, text = split_quantity(value)
            if text in PERIOD_NAMES:
                unit = "periods"
            elif not text:
                raise QuantityError("missing-unit", "a text needs its unit: periods or s")
            else:
                number = parse_exact(value, "s")
        else:
            number = exact_number(value, "s")
        seconds = to_float(number)
    except QuantityError as error:
        report.fault(pointer, error.code, error.message, value, allowed=allowed)
        return None
    if seconds < 0.0 or (positive and seconds == 0.0) or seconds > _MAX_SECONDS:
        report.fault(pointer, "out-of-range", "is out of range", value, allowed=allowed)
        return None
    return [seconds + 0.0, unit]


def _read_window(report: Report, data: object) -> list[Time] | None:
    if not isinstance(data, list) or len(data) != 2:
        report.fault(
            "/run/window",
            "wrong-type",
            "must be a list of its start and its end",
            data,
            allowed='a list of two times in seconds or excitation periods, such as ["20 periods", "40 periods"]',
        )
        return None
    if refuse_mixed(nodes(report, [(join("/run/window", index), item) for index, item in enumerate(data)]), "s"):
        return None
    times = [_read_time(report, join("/run/window", index), item) for index, item in enumerate(data)]
    return None if None in times else [time for time in times if time is not None]


def _check_times(
    report: Report, run: Mapping[str, Any], given: Mapping[str, Any], frequencies: NDArray[np.float64]
) -> None:
    """Compare duration and window at the lowest and the highest frequency; in between both are linear."""
    for frequency in dict.fromkeys((float(frequencies.min()), float(frequencies.max()))):
        at = Sentence("") if _one_unit(run) else Sentence(" at {frequency}", frequency=Amount(frequency, "Hz", 6))
        duration = in_periods(run["duration"], frequency)
        if duration > MAX_RUN_PERIODS:
            report.fault(
                "/run/duration",
                "out-of-range",
                Sentence(
                    "is {periods} excitation periods at {frequency}",
                    periods=Amount(duration, digits=8),
                    frequency=Amount(frequency, "Hz", 6),
                ),
                given.get("duration"),
                allowed=Sentence("at most {periods} periods in any case", periods=int(MAX_RUN_PERIODS)),
            )
            return
        if run["window"] is None:
            if duration / 3.0 < 1.0 - _ROUNDING:
                report.warn(
                    "short-window",
                    "/run/duration",
                    Sentence(
                        "the window, its last third, is shorter than one excitation period at {frequency} ({count} "
                        "periods), so means over it depend on its position",
                        frequency=Amount(frequency, "Hz", 6),
                        count=Amount(duration / 3.0, digits=3),
                    ),
                )
            continue
        start, end = (in_periods(time, frequency) for time in run["window"])
        if not start < end * (1.0 - _ROUNDING):
            report.fault(
                "/run/window",
                "invalid-range",
                Sentence("starts at or after its end{at}", at=at),
                given["window"],
                allowed="start < end",
            )
            return
        if end > duration * (1.0 + _ROUNDING):
            report.fault(
                "/run/window/1", "out-of-range", Sentence("the window ends after the run{at}", at=at),
                given["window"][1],
                allowed=Sentence("at most the duration, {time}", time=time_text(run["duration"])),
            )  # fmt: skip
            return
        if end - start < 1.0 - _ROUNDING:
            report.warn(
                "short-window",
                "/run/window",
                Sentence(
                    "shorter than one excitation period at {frequency} ({count} periods), so means over it depend on "
                    "its position",
                    frequency=Amount(frequency, "Hz", 6),
                    count=Amount(end - start, digits=3),
                ),
            )


def _one_unit(run: Mapping[str, Any]) -> bool:
    return len({time[1] for time in (run["duration"], *(run["window"] or ()))}) == 1
