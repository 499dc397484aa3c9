"""Running cases of the vibration drive: a batch of parameters in, characteristics and endings out; one case's
trajectory.
"""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine import elementary
from sprag_study.engine.endings import ENDINGS
from sprag_study.engine.outcome import Batch, Trajectory
from sprag_study.engine.run import Run, SettledRun
from sprag_study.engine.vibration_drive.automaton import Clutch, Shaft
from sprag_study.engine.vibration_drive.cases import (
    case_matrix,
    harmonics,
    has_table,
    load_table,
    pendulum_count,
    scalars,
    unloaded,
)
from sprag_study.engine.vibration_drive.characteristics import characteristics
from sprag_study.engine.vibration_drive.integration import Integration, integrate
from sprag_study.engine.vibration_drive.kernel import kernel_of, order_for
from sprag_study.engine.vibration_drive.layout import OUT_ENDING, PendulumSample, ShaftSample, pendulum_samples
from sprag_study.engine.vibration_drive.parameters import HARMONICS, LOAD_TABLE, PARAMETERS

Floats = NDArray[np.float64]

#: Names of states in trajectories, by number.
CLUTCH_NAMES = {int(state): state.name.lower() for state in Clutch}
#: States in which the law of a clutch, and its damping, are in force.
_WOUND = [int(Clutch.ENGAGED), int(Clutch.BEYOND)]
SHAFT_NAMES = {int(state): state.name.lower() for state in Shaft}


def simulate(columns: Mapping[str, ArrayLike], run: Run, *, cases: int) -> Batch:
    """Run a batch of cases.

    The bits of a case's results do not depend on its batch, order or process.

    Parameters
    ----------
    columns : mapping
        Paths in a spec to scalars or arrays of shape (cases,), in SI units, frequency in Hz. The clutch is given as
        ``clutch.coefficients.0`` (c_1) and so on, with an optional ``clutch.windup_limit``, for all pendulums, or as
        ``pendulums.N.clutch...`` for one. Missing paths take the default of ``PARAMETERS``.
    run : Run
    cases : int
        Number of cases, at least 0.

    Returns
    -------
    Batch

    Raises
    ------
    ValueError
        If a required parameter is missing or the number of pendulums or coefficients is out of range.
    """
    if cases == 0:
        count = len(characteristics_names(pendulum_count(columns)))
        return Batch(np.empty((0, count)), np.empty(0, dtype=np.int8))
    module, matrix = kernel_of(columns, run.tolerance), case_matrix(columns, run, cases)
    sums = integrate(module, matrix, run).sums
    return Batch(characteristics(module.LAYOUT, matrix, sums), sums[:, OUT_ENDING].astype(np.int8))


def characteristics_names(pendulums: int) -> tuple[str, ...]:
    """Names of the result columns of a drive with that many pendulums."""
    from sprag_study.engine.vibration_drive.results import result_infos

    return tuple(info.name for info in result_infos(pendulums))


def _trajectory_columns(n: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    pairs = [
        ("base.displacement_x", "m"), ("base.displacement_y", "m"),
        ("shaft.angle", "rad"), ("shaft.speed", "rad/s"), ("shaft.acceleration", "rad/s^2"), ("torque", "N*m"),
        ("power.useful", "W"), ("power.clutch", "W"), ("power.input", "W"), ("power.loss", "W"),
    ]  # fmt: skip
    for i in range(n):
        pairs += [
            (f"pendulums.{i}.{name}", unit)
            for name, unit in (
                ("angle", "rad"), ("speed", "rad/s"), ("acceleration", "rad/s^2"), ("torque", "N*m"), ("windup", "rad"),
                ("power.input", "W"), ("power.loss", "W"),
            )
        ]  # fmt: skip
    return tuple(name for name, _ in pairs), tuple(unit for _, unit in pairs)


def trajectory(columns: Mapping[str, ArrayLike], run: Run, times: ArrayLike, start: Floats | None = None) -> Trajectory:
    """Run one case and sample it.

    Parameters
    ----------
    columns : mapping
        As for ``simulate``, scalars only.
    run : Run
    times : array, shape (m,)
        Times in s from the start, ascending, within the run. At a transition the value before it is given.
    start : array, shape (1, strobes.width(n)), optional
        The state from which the case is run, as ``starts`` of ``settle``, at the start of a period.

    Returns
    -------
    Trajectory
        The values come from the local polynomials of the integration: they are as accurate as its steps, at any
        sampling.

    Raises
    ------
    ValueError
        If the times are not ascending or not within the run.
    """
    asked = np.ascontiguousarray(times, dtype=np.float64)
    values = scalars(columns)
    frequency = values["excitation.frequency"]
    end = run.duration.in_periods(frequency) / frequency
    if asked.size and (np.any(np.diff(asked) < 0) or asked[0] < 0 or asked[-1] > end * (1 + 1e-12)):
        raise ValueError(f"times must ascend within 0 .. {end:g} s")
    periods = np.minimum(asked * frequency, run.duration.in_periods(frequency))
    module = kernel_of(values, run.tolerance)
    matrix = case_matrix(values, run, 1)
    found = integrate(module, matrix, run, starts=start, times=periods)
    return sampled(values, matrix, found, asked)


def sampled(
    values: Mapping[str, float],
    matrix: Floats,
    found: Integration,
    times: Floats,
    *,
    angle: Floats | None = None,
    load_factor: Floats | float = 1.0,
) -> Trajectory:
    """The instantaneous values that a call of the kernel has left of one case, by name.

    Parameters
    ----------
    values : mapping
        The case, as for ``trajectory``.
    matrix : array, shape (1, columns)
        The case, as the kernel read it.
    found : Integration
        Of a call that was asked for samples.
    times : array, shape (m,)
        The same times in s, from the start of an excitation period.
    angle, load_factor : array, shape (times that were reached,), optional
        Of a start-up the phase of the excitation in rad and the factor on the load at the times; without them the phase
        follows from the times.
    """
    n, done = pendulum_count(values), found.recorded
    frequency = values["excitation.frequency"]
    names, units = _trajectory_columns(n)
    times_done, samples, states = times[:done], found.samples[:done], found.states[:done]
    defaults = {parameter.path: parameter.default for parameter in PARAMETERS}
    value = {**{k: v for k, v in defaults.items() if v is not None}, **values}
    nu = 2.0 * math.pi * frequency
    phase = nu * times_done if angle is None else angle
    out = {
        "base.displacement_x": value["excitation.amplitude_x"] * elementary.cos(phase),
        "base.displacement_y": value["excitation.amplitude_y"] * elementary.sin(phase + value["excitation.phase"]),
    }
    for harmonic in harmonics(values, 1):
        # (m nu) t and m (nu t) differ in their last bit, and earlier motions have the first.
        turned = harmonic.order * nu * times_done if angle is None else harmonic.order * angle
        for axis, part in (
            ("x", harmonic.amplitude_x * elementary.cos(turned + harmonic.phase_x)),
            ("y", harmonic.amplitude_y * elementary.sin(turned + harmonic.phase_y)),
        ):
            out[f"base.displacement_{axis}"] = out[f"base.displacement_{axis}"] + part
    for column, name in zip(ShaftSample, ("shaft.angle", "shaft.speed", "shaft.acceleration", "torque"), strict=True):
        out[name] = samples[:, column]
    overrunning = [values.get(f"pendulums.{i}.overrunning_damping", 0.0) for i in range(n)]
    if not unloaded(matrix, n)[0]:
        # As for the minimum in ``characteristics``: only rounding errors can turn back a resisted shaft.
        out["shaft.speed"] = np.maximum(out["shaft.speed"], 0.0)
    load = _load_torque(value, out["shaft.speed"], out["shaft.angle"])
    out["power.useful"] = load * out["shaft.speed"] * load_factor
    out["power.clutch"] = out["torque"] * out["shaft.speed"]
    clutch_losses: list[Floats] = []
    for i in range(n):
        block = samples[:, pendulum_samples(i)]
        speed = block[:, PendulumSample.SPEED]
        for name in ("angle", "speed", "acceleration", "torque"):
            out[f"pendulums.{i}.{name}"] = block[:, PendulumSample[name.upper()]]
        engaged = states[:, 1 + i] >= Clutch.ENGAGED
        out[f"pendulums.{i}.windup"] = np.where(engaged, block[:, PendulumSample.WINDUP], 0.0)
        moment = value[f"pendulums.{i}.mass"] * value[f"pendulums.{i}.arm"]
        damping = values.get(f"pendulums.{i}.damping", 0.0)
        out[f"pendulums.{i}.power.input"] = moment * block[:, PendulumSample.DRIVE] * speed
        out[f"pendulums.{i}.power.loss"] = damping * np.square(speed)
        clutch = values.get(f"pendulums.{i}.clutch_damping", 0.0)
        rate = np.select([states[:, 1 + i] == Clutch.FREE, np.isin(states[:, 1 + i], _WOUND)], [overrunning[i], clutch])
        clutch_losses.append(rate * np.square(speed - out["shaft.speed"]))
    out["power.input"] = sum((out[f"pendulums.{i}.power.input"] for i in range(n)), np.zeros(done))
    lost = value["shaft.bearing_damping"] * np.square(out["shaft.speed"])
    for i in range(n):
        lost = lost + out[f"pendulums.{i}.power.loss"] + clutch_losses[i]
    out["power.loss"] = lost
    named = {"shaft": [SHAFT_NAMES[int(s)] for s in states[:, 0]]}
    for i in range(n):
        named[f"pendulums.{i}"] = [CLUTCH_NAMES[int(s)] for s in states[:, 1 + i]]
    ending = ENDINGS[int(found.sums[0, OUT_ENDING])]
    return Trajectory(times_done, names, units, np.column_stack([out[name] for name in names]), named, ending)


def _load_torque(value: Mapping[str, float], speed: Floats, angle: Floats) -> Floats:
    """Torque of the load in N*m at speeds in rad/s of a rotating shaft, and at its angles in rad from t = 0 on."""
    torque: Floats = value["shaft.load"] + (value["shaft.linear_load"] + value["shaft.quadratic_load"] * speed) * speed
    if value["shaft.stribeck_load"] > 0.0:
        torque = torque + value["shaft.stribeck_load"] * elementary.exp(-speed / value["shaft.stribeck_speed"])
    if value["shaft.cyclic_load"] > 0.0:
        cycle = elementary.cos(value["shaft.load_cycles"] * angle + value["shaft.load_phase"])
        torque = torque + value["shaft.load"] * value["shaft.cyclic_load"] * cycle
    if has_table(value):
        speeds, torques = load_table(value, 1)
        torque = torque + _interpolated(speeds[0], torques[0], speed)
    return torque


def _interpolated(speeds: Floats, torques: Floats, speed: Floats) -> Floats:
    """Torque in N*m on the straight lines between the rows of a load's table; at its ends that of the row there."""
    last = int(np.isfinite(speeds).sum()) - 1
    inside = np.clip(speed, speeds[0], speeds[last])
    row = np.clip(np.searchsorted(speeds[: last + 1], inside, side="right"), 1, max(last, 1)) - 1
    following = np.minimum(row + 1, last)
    width = speeds[following] - speeds[row]
    slope = np.divide(torques[following] - torques[row], width, out=np.zeros_like(inside), where=width > 0.0)
    value: Floats = torques[row] + slope * (inside - speeds[row])
    return value


def warm_up(
    pendulums: int,
    coefficients: int,
    tolerance: float,
    drag: bool = False,
    curved: bool = False,
    tabled: bool = False,
    harmonics: int = 0,
    ramped: bool = False,
) -> None:
    """Generate and compile the kernel of a shape, and what settles motions, so that others load them from the cache."""
    from sprag_study.engine.vibration_drive.settle import settle

    columns: dict[str, float] = {"excitation.frequency": 1.0, "shaft.inertia": 1.0, "shaft.load": 1.0}
    for i in range(pendulums):
        columns |= {f"pendulums.{i}.inertia": 1.0, f"pendulums.{i}.mass": 0.0, f"pendulums.{i}.arm": 0.0}
    columns |= {f"clutch.coefficients.{k}": 1.0 for k in range(max(1, coefficients))}
    columns |= {"shaft.bearing_damping": 1.0} if drag else {}
    columns |= {"shaft.stribeck_load": 1.0} if curved else {}
    columns |= {f"{LOAD_TABLE}0.speed": 0.0, f"{LOAD_TABLE}0.torque": 1.0} if tabled else {}
    columns |= {f"{HARMONICS}{k}.order": 2.0 for k in range(harmonics)}
    if ramped:
        from sprag_study.engine.vibration_drive.start_up import ramp_answers

        ramp_answers(columns, tolerance)
        return
    # Nothing moves, which is periodic: this runs all steps of the search, down to the means.
    settle(columns, SettledRun(tolerance=tolerance), cases=1)
    simulate(columns, Run(tolerance=tolerance), cases=1)


def estimate_seconds(pendulums: int, coefficients: int, tolerance: float, periods: float, period: float) -> float:
    """Rough time of one case among many on one core, in s; ``period`` of the excitation in s.

    A period takes about 25 steps, events and extrema included, and under slow excitation 31 a second, for the motion of
    the pendulum itself (338 at 0.1 Hz, 1,547 at 0.02 Hz).

    Measured at 0.077 us a step for one pendulum, 0.12 for two and 0.51 for eight (benchmarks/engine.py), with half as
    much again for slower machines.
    """
    order = order_for(tolerance)
    step = (
        (2.1e-8 + 9.4e-8 * pendulums)
        * (0.6 + 0.4 * (order / 12.0) * (order / 12.0))
        * (0.8 + 0.05 * max(4, coefficients))
    )
    return 1e-5 + periods * (25.0 + 31.0 * period) * step
