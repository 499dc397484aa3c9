"""From the sums, marks and extrema of a run to the named characteristics (docs/theory.md)."""

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.vibration_drive.cases import (
    Column,
    PendulumColumn,
    bends,
    pendulum_column,
    stop_column,
    unloaded,
)
from sprag_study.engine.vibration_drive.layout import OUT_EVENTS, OUT_RUNUP, OUT_STEPS, OUT_SUMS, Layout
from sprag_study.engine.vibration_drive.regimes import keeps_windup
from sprag_study.engine.vibration_drive.results import result_infos

Floats = NDArray[np.float64]


def _shaft_width(lay: Layout) -> int:
    return lay.energy_lost - lay.sum_held + 1


def _pendulum_width(lay: Layout) -> int:
    return lay.p_u_max - lay.p_sum_phi + 1


def sum_columns(lay: Layout) -> int:
    """Columns of the matrix of sums that the kernel fills for each case."""
    return OUT_SUMS + _shaft_width(lay) + lay.n * _pendulum_width(lay)


def _ratio(numerator: Floats, denominator: Floats) -> Floats:
    """Quotient; NaN where the denominator is not positive."""
    out = np.full(np.broadcast(numerator, denominator).shape, np.nan)
    np.divide(numerator, denominator, out=out, where=denominator > 0.0)
    return out


class _Cases:
    """Named columns of the case matrix and of the sums."""

    def __init__(self, lay: Layout, matrix: Floats, sums: Floats) -> None:
        self.lay, self.matrix, self.sums = lay, matrix, sums
        self.period, self.load = matrix[:, Column.PERIOD], matrix[:, Column.LOAD]
        self.inertia = matrix[:, Column.INERTIA]
        self.bearing, self.linear = matrix[:, Column.BEARING], matrix[:, Column.LINEAR]
        self.quadratic = matrix[:, Column.QUADRATIC]
        start, whole, end = (matrix[:, stop_column(k)] + matrix[:, stop_column(k) + 1] for k in range(3))
        self.periods = end - start
        self.whole_periods = end - whole
        self.length = self.periods * self.period
        # The steps' sum rather than the length, so that shares of it are exactly 0 or 1 where they should be.
        self.time = self.shaft("time_held") + self.shaft("time_rotating")

    def shaft(self, name: str) -> Floats:
        row: int = getattr(self.lay, name)
        column: Floats = self.sums[:, OUT_SUMS + row - self.lay.sum_held]
        return column

    def pendulum(self, i: int, name: str) -> Floats:
        row: int = getattr(self.lay, f"p_{name}")
        first = OUT_SUMS + _shaft_width(self.lay) + i * _pendulum_width(self.lay)
        column: Floats = self.sums[:, first + row - self.lay.p_sum_phi]
        return column

    def work_against_load(self, turn: Floats, square: Floats, cube: Floats, curve: Floats) -> Floats:
        """Work in J against the load, from the integrals of the shaft's speed, its square and its cube, and the work
        against the terms of the load that are no polynomial.
        """
        work: Floats = self.load * turn + self.linear * square + self.quadratic * cube + curve
        return work

    def parameter(self, i: int, column: PendulumColumn) -> Floats:
        values: Floats = self.matrix[:, pendulum_column(self.lay.coefficients, i, column)]
        return values


def characteristics(lay: Layout, matrix: Floats, sums: Floats) -> Floats:
    """Characteristics of every case.

    Parameters
    ----------
    lay : Layout
    matrix : array, shape (cases, columns)
        From ``cases.case_matrix``.
    sums : array, shape (cases, sum_columns(lay))
        As the kernel filled them; NaN for a case without results.

    Returns
    -------
    array, shape (cases, results)
        In the order of ``result_infos(lay.n)``; NaN where a value could not be computed (docs/theory.md).
    """
    cases = _Cases(lay, matrix, sums)
    out: dict[str, Floats] = {}
    for i in range(lay.n):
        _pendulum(cases, i, out)
    _shaft(cases, out)
    _balances(cases, out)
    return np.column_stack([out[info.name] for info in result_infos(lay.n)])


#: Sums, marks and extrema that are 0 where the shaft stands.
_OF_ROTATION = (
    "time_rotating", "speed_square", "speed_cube", "curve_impulse", "curve_work", "work_clutch", "speed_max",
    "speed_min", "acc_max", "power_max", "useful_max", "turn_0", "turn_1", "turn_2", "speed_0", "speed_2", "square_1",
    "cube_1", "curve_1",
)  # fmt: skip


def of_orbits(lay: Layout, matrix: Floats, sums: Floats) -> Floats:
    """Characteristics of settled motions.

    A shaft that is resisted and that no clutch drives stands on an orbit, up to rounding, even where nothing holds it:
    without a dry load the automaton counts it as rotating.

    Parameters
    ----------
    lay, matrix, sums :
        As of ``characteristics``, over a whole turn of an orbit.

    Returns
    -------
    array, shape (cases, results)
        As of ``characteristics``.
    """
    cases = _Cases(lay, matrix, sums.copy())
    stands = ~unloaded(matrix, lay.n) & (cases.shaft("time_rotating") > 0.0) & (cases.shaft("time_driven") == 0.0)
    cases.shaft("time_held")[stands] = cases.time[stands]
    for name in _OF_ROTATION:
        cases.shaft(name)[stands] = 0.0
    return characteristics(lay, matrix, cases.sums)


def tied_clutches(lay: Layout, matrix: Floats, sums: Floats) -> NDArray[np.bool_]:
    """Clutches that stay in interaction with a held shaft, without letting go: their pendulums' angles and windups
    differ by a constant all the time.

    Parameters
    ----------
    lay, matrix, sums :
        As of ``characteristics``, over a whole turn of an orbit.

    Returns
    -------
    array, shape (cases, pendulums)
        A clutch that takes up its backlash all the time is among them where nothing else happens.
    """
    cases = _Cases(lay, matrix, sums)
    held = cases.shaft("time_rotating") == 0.0
    columns = []
    for i in range(lay.n):
        wound = keeps_windup(
            cases.pendulum(i, "time_engaged"), cases.shaft("time_held"), cases.pendulum(i, "engagements")
        )
        columns.append(held & (wound | (sums[:, OUT_EVENTS] == 0.0)))
    return np.column_stack(columns)


_SMALLEST = ("speed_min", "p_phi_min", "p_speed_min", "p_acc_min")
_LARGEST = (
    "speed_max", "acc_max", "sum_max", "power_max", "useful_max", "driving_max", "p_phi_max", "p_speed_max",
    "p_acc_max", "p_torque_max", "p_u_max",
)  # fmt: skip
_LATEST = ("speed_2", "energy_2")
_FIRST = ("speed_0", "energy_0", "turn_0", "turn_1", "input_1", "square_1", "cube_1", "curve_1")


def combined(lay: Layout, parts: list[Floats]) -> Floats:
    """Sums over windows that follow each other, each with its marks taken from its own start.

    ``parts`` holds the matrices of sums of the windows, all of the same cases; the result is as ``characteristics``
    reads it.
    """
    total = parts[0].copy()
    shaft = [(name, [OUT_SUMS + getattr(lay, name) - lay.sum_held]) for name in _rows(lay, "sum_held", "energy_lost")]
    first = OUT_SUMS + _shaft_width(lay) - lay.p_sum_phi
    width = _pendulum_width(lay)
    pendulums = [
        (name, [first + i * width + getattr(lay, name) for i in range(lay.n)])
        for name in _rows(lay, "p_sum_phi", "p_u_max")
    ]
    for part in parts[1:]:
        total[:, OUT_STEPS] += part[:, OUT_STEPS]
        total[:, OUT_EVENTS] += part[:, OUT_EVENTS]
        for name, columns in shaft + pendulums:
            for column in columns:
                if name in _LARGEST:
                    total[:, column] = np.maximum(total[:, column], part[:, column])
                elif name in _SMALLEST:
                    total[:, column] = np.minimum(total[:, column], part[:, column])
                elif name in _LATEST:
                    total[:, column] = part[:, column]
                elif name not in _FIRST:
                    total[:, column] += part[:, column]
    return total


def _rows(lay: Layout, first: str, last: str) -> tuple[str, ...]:
    """Names of the layout's fields from one to another."""
    return lay._fields[lay._fields.index(first) : lay._fields.index(last) + 1]


def _pendulum(cases: _Cases, i: int, out: dict[str, Floats]) -> None:
    def put(name: str, values: Floats) -> None:
        out[f"pendulums.{i}.{name}"] = values

    inertia = cases.parameter(i, PendulumColumn.INERTIA)
    mean = cases.pendulum(i, "sum_phi") / cases.length
    put("angle.mean", np.clip(mean, cases.pendulum(i, "phi_min"), cases.pendulum(i, "phi_max")))
    put("angle.max", cases.pendulum(i, "phi_max"))
    put("angle.min", cases.pendulum(i, "phi_min"))
    put("angle.amplitude", 0.5 * (cases.pendulum(i, "phi_max") - cases.pendulum(i, "phi_min")))
    put("speed.max", cases.pendulum(i, "speed_max"))
    put("speed.min", cases.pendulum(i, "speed_min"))
    put("acceleration.max", cases.pendulum(i, "acc_max"))
    put("acceleration.min", cases.pendulum(i, "acc_min"))
    put("torque.mean", cases.pendulum(i, "sum_torque") / cases.length)
    put("torque.max", cases.pendulum(i, "torque_max"))
    put("windup.max", cases.pendulum(i, "u_max"))
    put("fraction.engaged", cases.pendulum(i, "time_engaged") / cases.time)
    put("fraction.beyond_data", cases.pendulum(i, "time_beyond") / cases.time)
    put("engagements", cases.pendulum(i, "engagements"))
    put("power.input", cases.parameter(i, PendulumColumn.ML) * inertia * cases.pendulum(i, "work_input") / cases.length)
    put("power.clutch_loss", cases.pendulum(i, "work_clutch") / cases.length)
    put(
        "power.loss",
        cases.parameter(i, PendulumColumn.DAMPING) * inertia * cases.pendulum(i, "work_loss") / cases.length,
    )


def _over_pendulums(cases: _Cases, out: dict[str, Floats], name: str) -> Floats:
    total = np.zeros(len(cases.matrix))
    for i in range(cases.lay.n):
        total = total + out[f"pendulums.{i}.{name}"]
    return total


def _shaft(cases: _Cases, out: dict[str, Floats]) -> None:
    turn = cases.shaft("turn_2") - cases.shaft("turn_0")
    lowest, highest = cases.shaft("speed_min"), cases.shaft("speed_max")
    # Where anything resists it the shaft never turns back: a negative speed is a rounding error about a standstill.
    resisted = ~unloaded(cases.matrix, cases.lay.n)
    lowest, highest = (np.where(resisted & (speed < 0.0), 0.0, speed) for speed in (lowest, highest))
    # Within its extrema in spite of rounding: the mean of a steady speed is that speed.
    mean = np.clip(turn / cases.length, lowest, highest)
    out["shaft.speed.mean"] = mean
    out["shaft.speed.max"] = highest
    out["shaft.speed.min"] = lowest
    out["shaft.irregularity"] = _ratio(highest - lowest, mean)
    out["shaft.turn"] = turn
    out["shaft.acceleration.max"] = cases.shaft("acc_max")
    out["torque.mean"] = _over_pendulums(cases, out, "torque.mean")
    out["torque.max"] = cases.shaft("sum_max") if cases.lay.n > 1 else cases.pendulum(0, "torque_max")
    square, cube = cases.shaft("speed_square"), cases.shaft("speed_cube")
    out["power.bearing.mean"] = cases.bearing * square / cases.length
    out["power.linear.mean"] = cases.linear * square / cases.length
    out["power.quadratic.mean"] = cases.quadratic * cube / cases.length
    curve = cases.shaft("curve_work")
    polynomial = cases.load * mean + (out["power.linear.mean"] + out["power.quadratic.mean"])
    out["power.useful.mean"] = polynomial + curve / cases.length
    # The power of a load that does not fall is largest at the largest speed.
    rising = cases.work_against_load(highest, np.square(highest), highest * np.square(highest), np.zeros_like(highest))
    out["power.useful.max"] = np.where(bends(cases.matrix), cases.shaft("useful_max"), rising)
    out["power.clutch.mean"] = cases.shaft("work_clutch") / cases.length
    out["power.clutch.max"] = cases.shaft("power_max")
    out["power.input.mean"] = _over_pendulums(cases, out, "power.input")
    clutches = _over_pendulums(cases, out, "power.clutch_loss")
    out["power.loss.mean"] = _over_pendulums(cases, out, "power.loss") + (out["power.bearing.mean"] + clutches)
    out["power.stored.mean"] = (cases.shaft("energy_2") - cases.shaft("energy_0")) / cases.length
    useful = cases.work_against_load(
        cases.shaft("turn_2") - cases.shaft("turn_1"),
        square - cases.shaft("square_1"),
        cube - cases.shaft("cube_1"),
        curve - cases.shaft("curve_1"),
    )
    supplied = out["power.input.mean"] * cases.length - cases.shaft("input_1")
    out["efficiency"] = np.where(cases.whole_periods > 0.5, _ratio(useful, supplied), np.nan)
    out["fraction.rotating"] = cases.shaft("time_rotating") / cases.time
    out["fraction.held"] = cases.shaft("time_held") / cases.time
    out["fraction.driven"] = cases.shaft("time_driven") / cases.time
    out["clutches.driving_max"] = cases.shaft("driving_max")
    out["clutches.engagements_per_period"] = _over_pendulums(cases, out, "engagements") / cases.periods
    out["runup.time"] = cases.sums[:, OUT_RUNUP]
    out["reset.energy_lost"] = cases.shaft("energy_lost")
    out["run.events"] = cases.sums[:, OUT_EVENTS]
    out["run.steps"] = cases.sums[:, OUT_STEPS]


def _balances(cases: _Cases, out: dict[str, Floats]) -> None:
    """Residuals of both balances (docs/theory.md, "Balances"), each over the largest of its own terms.

    The terms include the largest kinetic energy and angular momentum of the shaft in the window, so that a machine that
    only swings or coasts, with almost no work done, is not judged against zero.
    """
    length = cases.length
    turn = cases.shaft("turn_2") - cases.shaft("turn_0")
    supplied = out["power.input.mean"] * length
    stored = out["power.stored.mean"] * length
    lost = out["power.loss.mean"] * length
    square = cases.shaft("speed_square")
    useful = cases.work_against_load(turn, square, cases.shaft("speed_cube"), cases.shaft("curve_work"))
    kinetic = 0.5 * cases.inertia * np.square(cases.shaft("speed_max"))
    for i in range(cases.lay.n):
        fastest = np.maximum(cases.pendulum(i, "speed_max"), -cases.pendulum(i, "speed_min"))
        kinetic = kinetic + 0.5 * cases.parameter(i, PendulumColumn.INERTIA) * np.square(fastest)
    # A motion that has died away consists of rounding errors only and is judged against a swing of 3e-5 rad.
    least = np.zeros_like(cases.period)
    for i in range(cases.lay.n):
        least = least + 1e-9 * cases.parameter(i, PendulumColumn.INERTIA) * np.square(2.0 * np.pi / cases.period)
    size = np.max(np.abs([supplied, stored, lost, useful, kinetic, least]), axis=0)
    residual = supplied - stored - lost - useful - cases.shaft("energy_lost")
    out["balance.energy"] = np.where(size > 0.0, _ratio(np.abs(residual), size), np.where(np.isnan(size), np.nan, 0.0))

    impulse = out["torque.mean"] * length
    against = (
        cases.load * cases.shaft("time_rotating")
        + (cases.bearing + cases.linear) * turn
        + cases.quadratic * square
        + cases.shaft("curve_impulse")
    )
    gained = cases.inertia * (cases.shaft("speed_2") - cases.shaft("speed_0"))
    held = cases.shaft("sum_held")
    carried = cases.inertia * cases.shaft("speed_max")
    size = np.max(np.abs([impulse, against, gained, held, carried]), axis=0)
    residual = impulse - against - gained - held
    out["balance.momentum"] = np.where(
        size > 0.0, _ratio(np.abs(residual), size), np.where(np.isnan(size), np.nan, 0.0)
    )
