"""The run of a spec: duration, window, tolerance, reading of equation (5)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from service.spec.fields import read_object
from service.spec.report import Report, did_you_mean, join
from service.spec.units import PERIOD_NAMES, QuantityError, exact_number, parse_exact, split_quantity, to_float
from worker.limits import MAX_RUN_PERIODS, MAX_TOLERANCE, MIN_TOLERANCE

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

FIELDS: Final = ("duration", "window", "tolerance", "reset")
RESETS: Final = ("contact", "literal")
DEFAULTS: Final[dict[str, Any]] = {"duration": [60.0, "periods"], "window": None, "tolerance": 1e-9, "reset": "contact"}
_TIME: Final = 'seconds (2.0 or "2 s") or excitation periods ("60 periods")'
_MAX_SECONDS: Final = 1e9
#: Ends that are equal but for the rounding of a conversion between seconds and periods count as equal.
_ROUNDING: Final = 1e-9

Time = list[Any]  # [number, "periods" | "s"], as a study keeps it


def read_run(report: Report, data: object, frequencies: NDArray[np.float64]) -> dict[str, Any]:
    """The run as a study keeps it (see `Study.run`), everything wrong with it noted in ``report``.

    Parameters
    ----------
    frequencies : every excitation frequency (Hz) of the study; empty when they could not be read
    """
    run = dict(DEFAULTS)
    found = read_object(report, "/run", data, FIELDS)
    if found is None:
        return run
    before = report.found
    if "duration" in found:
        run["duration"] = _read_time(report, "/run/duration", found["duration"], positive=True)
    if "window" in found:
        run["window"] = _read_window(report, found["window"])
    if "tolerance" in found:
        run["tolerance"] = _read_tolerance(report, found["tolerance"])
    if "reset" in found:
        run["reset"] = _read_reset(report, found["reset"])
    if report.found == before and frequencies.size:
        _check_times(report, run, found, frequencies)
    return run


def refuse_run(report: Report, data: object, why: str = "is not used: this model has no run") -> dict[str, Any]:
    """The empty run of a model that has none; every field of one that was given is noted in ``report``."""
    if not isinstance(data, Mapping):
        report.problem("/run", "must be an object", data, allowed="nothing, or an empty object: this model has no run")
        return {}
    for name, value in data.items():
        report.problem(join("/run", name), why, value, allowed="no `run`")
    return {}


def in_periods(time: Time, frequency: float) -> float:
    """A time of a run in excitation periods at ``frequency`` (Hz)."""
    return float(time[0]) if time[1] == "periods" else float(time[0]) * frequency


def time_text(time: Time) -> str:
    """A time of a run as people write it."""
    return f"{time[0]:g} {time[1]}"


def _read_time(report: Report, pointer: str, value: object, *, positive: bool = False) -> Time | None:
    allowed = ("> 0" if positive else ">= 0") + f", in {_TIME}"
    try:
        unit = "s"
        if isinstance(value, str):
            number, text = split_quantity(value)
            if text in PERIOD_NAMES:
                unit = "periods"
            elif not text:
                raise QuantityError("a text needs its unit: periods or s")
            else:
                number = parse_exact(value, "s")
        else:
            number = exact_number(value, "s")
        seconds = to_float(number)
    except QuantityError as error:
        report.problem(pointer, str(error), value, allowed=allowed)
        return None
    if seconds < 0.0 or (positive and seconds == 0.0) or seconds > _MAX_SECONDS:
        report.problem(pointer, "is out of range", value, allowed=allowed)
        return None
    return [seconds + 0.0, unit]


def _read_window(report: Report, data: object) -> list[Time] | None:
    if not isinstance(data, list) or len(data) != 2:
        report.problem("/run/window", "must be a list of its start and its end", data, allowed=f"two times in {_TIME}")
        return None
    times = [_read_time(report, join("/run/window", index), item) for index, item in enumerate(data)]
    return None if None in times else [time for time in times if time is not None]


def _read_tolerance(report: Report, value: object) -> float | None:
    allowed = f"{MIN_TOLERANCE:g} to {MAX_TOLERANCE:g}, a plain number"
    if isinstance(value, bool) or not isinstance(value, int | float):
        report.problem("/run/tolerance", "must be a plain number", value, allowed=allowed)
        return None
    if not MIN_TOLERANCE <= value <= MAX_TOLERANCE:
        report.problem("/run/tolerance", "is out of range", value, allowed=allowed)
        return None
    return float(value)


def _read_reset(report: Report, value: object) -> str | None:
    if isinstance(value, str) and value in RESETS:
        return value
    hint = did_you_mean(value, RESETS) if isinstance(value, str) else ""
    report.problem("/run/reset", f"must be one of the two readings{hint}", value, allowed="'contact' or 'literal'")
    return None


def _check_times(
    report: Report, run: Mapping[str, Any], given: Mapping[str, Any], frequencies: NDArray[np.float64]
) -> None:
    """Compares duration and window at the lowest and the highest frequency; in between all goes straight."""
    for frequency in dict.fromkeys((float(frequencies.min()), float(frequencies.max()))):
        at = "" if _one_unit(run) else f" at {frequency:.6g} Hz"
        duration = in_periods(run["duration"], frequency)
        if duration > MAX_RUN_PERIODS:
            report.problem(
                "/run/duration", f"is {duration:.6g} excitation periods at {frequency:.6g} Hz", given.get("duration"),
                allowed=f"at most {MAX_RUN_PERIODS:,.0f} periods in any case",
            )  # fmt: skip
            return
        if run["window"] is None:
            if duration / 3.0 < 1.0 - _ROUNDING:
                report.warn(
                    f"/run/duration: the window, its last third, is shorter than one excitation period at "
                    f"{frequency:.6g} Hz ({duration / 3.0:.3g} periods), so means over it depend on where it lies"
                )
            continue
        start, end = (in_periods(time, frequency) for time in run["window"])
        if not start < end * (1.0 - _ROUNDING):
            report.problem("/run/window", f"starts at or after its end{at}", given["window"], allowed="start < end")
            return
        if end > duration * (1.0 + _ROUNDING):
            report.problem(
                "/run/window/1", f"the window ends after the run{at}", given["window"][1],
                allowed=f"at most the duration, {time_text(run['duration'])}",
            )  # fmt: skip
            return
        if end - start < 1.0 - _ROUNDING:
            report.warn(
                f"/run/window: shorter than one excitation period at {frequency:.6g} Hz ({end - start:.3g} periods), "
                "so means over it depend on where it lies"
            )


def _one_unit(run: Mapping[str, Any]) -> bool:
    return len({time[1] for time in (run["duration"], *(run["window"] or ()))}) == 1
