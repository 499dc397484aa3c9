"""Instantaneous values of one case: which times, and the document or table of them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from service.curves import numbers
from service.errors import parameter_error, shown, to_bytes
from service.exports import table_csv
from service.units import PERIOD_NAMES, QuantityError, parse_quantity, split_quantity, to_float
from worker import kernels

if TYPE_CHECKING:
    from service.exports import Format
    from worker.kernels import Trajectory
    from worker.study import Study


def span(study: Study, case: int, start: str | None, end: str | None) -> tuple[float, float]:
    """First and last time (s) of a part of the run; by default the whole run.

    ``start`` and ``end`` are numbers in s, or quantities with a unit of time or in excitation periods. Raises ApiError,
    about the parameter ``from`` or ``to``, when they are no times within the run.
    """
    duration = kernels.duration_seconds(study, case)
    frequency = {**study.base, **study.case_parameters(case)}["excitation.frequency"]
    first = 0.0 if start is None else _time("from", start, frequency)
    last = duration if end is None else _time("to", end, frequency)
    # The last digit of a duration given in periods is not the client's to know.
    if math.isclose(last, duration, rel_tol=1e-12):
        last = duration
    if not 0.0 <= first < duration:
        raise parameter_error("from", "outside the run", shown(start), f"0 .. {duration!r} s, before `to`")
    if not first < last <= duration:
        raise parameter_error("to", "outside the run, or not after `from`", shown(end), f"{first!r} .. {duration!r} s")
    return first, last


def _time(name: str, text: str, frequency: float) -> float:
    try:
        number, unit = split_quantity(text)
        if unit in PERIOD_NAMES:
            return to_float(number) / frequency
        return parse_quantity(text, "s") if unit else to_float(number)
    except QuantityError as error:
        raise parameter_error(name, str(error), shown(text), "a time in s or periods") from error


def trajectory_file(study: Study, case: int, start: float, end: float, points: int, form: Format) -> bytes:
    """The case run again and written down. For the computing process: large answers take seconds to write."""
    made = kernels.run_trajectory(study, case, start, end, points)
    if form == "csv":
        return trajectory_csv(made)
    return to_bytes(trajectory_json(made, case, study.case_parameters(case)))


def trajectory_json(made: Trajectory, case: int, parameters: dict[str, float]) -> dict[str, Any]:
    """The values as JSON data; ``parameters`` are the axis parameters of the case, SI."""
    return {
        "case": case,
        "parameters": parameters,
        "times": made.times.tolist(),
        "variables": {name: {"unit": unit} for name, unit in zip(made.names, made.units, strict=True)},
        "values": {name: numbers(made.values[:, column]) for column, name in enumerate(made.names)},
        "states": {name: list(states) for name, states in made.states.items()},
        "ending": str(made.ending),
    }


def trajectory_csv(made: Trajectory) -> bytes:
    """The values as CSV: time, every variable, every state."""
    header = ["time", *made.names, *(f"{name}.state" for name in made.states)]
    columns = [made.times.tolist(), *(made.values[:, i].tolist() for i in range(len(made.names)))]
    return table_csv(header, [*columns, *made.states.values()])
