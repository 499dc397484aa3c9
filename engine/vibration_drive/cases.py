"""Conversion of parameter columns to the matrix of cases that compiled code reads."""

import math
from collections.abc import Iterable, Mapping
from enum import IntEnum, auto
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine import elementary
from sprag_study.engine.run import Run
from sprag_study.engine.vibration_drive.parameters import (
    CURVE,
    DRAG,
    HARMONIC_FACTOR,
    HARMONICS,
    LOAD_FACTOR,
    LOAD_TABLE,
    MAX_COEFFICIENTS,
    MAX_HARMONICS,
    MAX_LOAD_ROWS,
    MAX_PENDULUMS,
    PARAMETERS,
)

Floats = NDArray[np.float64]


class Column(IntEnum):
    """Columns of a case that its excitation and its shaft have; after them come the speeds and the torques of the table
    of its load, the stops, the pendulums, then the harmonics of the base."""

    NU = 0
    PERIOD = auto()
    ACC_X = auto()
    ACC_Y = auto()
    CHI = auto()
    VIBRATION_X = auto()
    VIBRATION_Y = auto()
    HIGHEST_ORDER = auto()
    HARMONICS = auto()
    GRAVITY = auto()
    LOAD = auto()
    BEARING = auto()
    LINEAR = auto()
    QUADRATIC = auto()
    STRIBECK = auto()
    STRIBECK_RATE = auto()
    CYCLIC = auto()
    CYCLES = auto()
    CYCLE = auto()
    INERTIA = auto()
    INVERSE_RATE = auto()
    SPEED = auto()
    MOST_STEPS = auto()
    PHASE = auto()
    PHASE_RATE = auto()
    PHASE_SLOPE = auto()
    LOAD_FACTOR = auto()
    LOAD_SLOPE = auto()


class PendulumColumn(IntEnum):
    """Columns that each pendulum has, before its clutch coefficients; the first ones, up to OVERRUNNING_DAMPING, as
    the layout has them."""

    ML = 0
    SPRING = auto()
    DAMPING = auto()
    INVERSE_INERTIA = auto()
    INERTIA = auto()
    BACKLASH = auto()
    LIMIT = auto()
    CLUTCH_DAMPING = auto()
    OVERRUNNING_DAMPING = auto()
    ANGLE = auto()
    SPEED = auto()
    WINDUP = auto()
    CLUTCH = auto()


class HarmonicColumn(IntEnum):
    """Columns that each harmonic of the base has: its order, and the factors of cosine and sine of its angle in the
    acceleration of the base in x and y, in m/s^2."""

    ORDER = 0
    X_COS = auto()
    X_SIN = auto()
    Y_COS = auto()
    Y_SIN = auto()


class Harmonic(NamedTuple):
    """A harmonic of the base of some cases: its order, and amplitudes (m) and phases (rad) along x and y.

    The base moves by ``amplitude_x cos(order nu t + phase_x)`` and ``amplitude_y sin(order nu t + phase_y)``.
    """

    order: Floats
    amplitude_x: Floats
    phase_x: Floats
    amplitude_y: Floats
    phase_y: Floats


#: Columns with the speeds of the rows of the table of the load, and with their torques.
TABLE_SPEEDS = slice(len(Column), len(Column) + MAX_LOAD_ROWS)
TABLE_TORQUES = slice(TABLE_SPEEDS.stop, TABLE_SPEEDS.stop + MAX_LOAD_ROWS)
SHAFT_COLUMNS = TABLE_TORQUES.stop
#: Stops, each a pair of columns: whole periods, fraction.
STOPS = 4
PENDULUM_COLUMNS = len(PendulumColumn)
HARMONIC_COLUMNS = len(HarmonicColumn)
#: Numbers of harmonics for which there are kernels.
_ROOMS = (0, 2, 4, 8, MAX_HARMONICS)
#: Fewest clutch coefficients of a kernel: the straight line beyond the data needs two.
MIN_COEFFICIENTS = 2
#: A stop this close to a whole period counts as one.
_WHOLE = 1e-12
#: Motions of a machine of its own that the step budget allows for, at most, in rad/s: faster ones are mistakes more
#: often than machines, and a case of them is to end while it still costs little.
_FASTEST_OWN = 2.0 * math.pi * 1000.0

_DEFAULTS = {parameter.path: parameter.default for parameter in PARAMETERS}


def pendulum_count(columns: Mapping[str, ArrayLike]) -> int:
    """Number of pendulums in the paths."""
    indices = [int(path.split(".")[1]) for path in columns if path.startswith("pendulums.")]
    if not indices or max(indices) >= MAX_PENDULUMS:
        raise ValueError(f"a drive has 1 to {MAX_PENDULUMS} pendulums, numbered from 0")
    return max(indices) + 1


def default_of(path: str) -> float | None:
    """The value of a parameter that is not given; None where it is required."""
    return _DEFAULTS[".".join("N" if part.isdigit() else part for part in path.split("."))]


def of_cases(columns: Mapping[str, ArrayLike], cases: NDArray[np.int64] | slice | int) -> dict[str, ArrayLike]:
    """The parameters of some cases of a batch, or as numbers those of one."""
    return {path: value[cases] if (value := np.asarray(column)).ndim else column for path, column in columns.items()}


def scalars(columns: Mapping[str, ArrayLike]) -> dict[str, float]:
    """The parameters of one case as numbers."""
    return {path: float(np.asarray(value)) for path, value in columns.items()}


def _law_prefix(columns: Mapping[str, ArrayLike], pendulum: int) -> str:
    own = f"pendulums.{pendulum}.clutch."
    return own if any(path.startswith(own) for path in columns) else "clutch."


def coefficient_count(columns: Mapping[str, ArrayLike]) -> int:
    """Number of clutch coefficients a kernel for these cases needs (the most of any pendulum)."""
    marker = "clutch.coefficients."
    orders = [int(path.rsplit(".", 1)[1]) + 1 for path in columns if marker in path]
    if not orders or max(orders) > MAX_COEFFICIENTS:
        raise ValueError(f"a clutch law has 1 to {MAX_COEFFICIENTS} coefficients")
    return max(MIN_COEFFICIENTS, *orders)


def has_drag(paths: Iterable[str]) -> bool:
    """Whether any of the parameters is a torque that depends on speeds."""
    return any(path.rpartition(".")[2] in DRAG for path in paths)


def has_curve(paths: Iterable[str]) -> bool:
    """Whether any of the parameters is that of a load that is no polynomial of the speed."""
    return any(path.rpartition(".")[2] in CURVE for path in paths)


def has_table(paths: Iterable[str]) -> bool:
    """Whether any of the parameters is that of a load that is given as a table."""
    return any(path.startswith(LOAD_TABLE) for path in paths)


def load_table(columns: Mapping[str, ArrayLike], cases: int) -> tuple[Floats, Floats]:
    """Speeds (rad/s) and torques (N*m) of the tables of the loads, shape (cases, MAX_LOAD_ROWS) each.

    The torques have their factor. Rows that a table does not have are at an infinite speed.
    """
    speeds, torques = np.full((cases, MAX_LOAD_ROWS), math.inf), np.zeros((cases, MAX_LOAD_ROWS))
    for k in range(MAX_LOAD_ROWS if has_table(columns) else 0):
        speeds[:, k] = columns.get(f"{LOAD_TABLE}{k}.speed", math.inf)
        torques[:, k] = columns.get(f"{LOAD_TABLE}{k}.torque", 0.0)
    factor = np.asarray(columns.get(LOAD_FACTOR, 1.0), dtype=np.float64)
    return speeds, torques * factor.reshape(-1, 1)


def _harmonic_numbers(paths: Iterable[str]) -> list[int]:
    return sorted({int(path.split(".")[2]) for path in paths if path.startswith(HARMONICS)})


def harmonic_room(paths: Iterable[str]) -> int:
    """Number of harmonics that a kernel for a base with these parameters has; 0 where the base has none.

    Raises
    ------
    ValueError
        If there are more than `MAX_HARMONICS`.
    """
    count = len(_harmonic_numbers(paths))
    if count > MAX_HARMONICS:
        raise ValueError(f"a base vibration has at most {MAX_HARMONICS} harmonics")
    return next(room for room in _ROOMS if count <= room)


def harmonics(columns: Mapping[str, ArrayLike], cases: int) -> list[Harmonic]:
    """The harmonics of the base of some cases, arrays of shape (cases,); their amplitudes have their factor."""

    def column(path: str, default: float = 0.0) -> Floats:
        return np.broadcast_to(np.asarray(columns.get(path, default), dtype=np.float64), (cases,))

    factor = column(HARMONIC_FACTOR, 1.0)
    listed = []
    for k in _harmonic_numbers(columns):
        order, x, phase_x, y, phase_y = (column(f"{HARMONICS}{k}.{name}") for name in Harmonic._fields)
        listed.append(Harmonic(order, factor * x, phase_x, factor * y, phase_y))
    return listed


def harmonic_columns(harmonic: Harmonic, nu: Floats) -> list[Floats]:
    """Columns of a harmonic of bases that vibrate at ``nu`` in rad/s, in the order of `HarmonicColumn`."""
    square = np.square(harmonic.order * nu)
    x, y = harmonic.amplitude_x * square, harmonic.amplitude_y * square
    return [
        harmonic.order,
        -x * elementary.cos(harmonic.phase_x), x * elementary.sin(harmonic.phase_x),
        -y * elementary.sin(harmonic.phase_y), -y * elementary.cos(harmonic.phase_y),
    ]  # fmt: skip


def of_pendulums(matrix: Floats, pendulums: int, column: PendulumColumn) -> Floats:
    """A column of every pendulum of the cases of a matrix, shape (cases, pendulums)."""
    harmonic = int(matrix[0, Column.HARMONICS]) * HARMONIC_COLUMNS if len(matrix) else 0
    width = (matrix.shape[1] - stop_column(STOPS) - harmonic) // pendulums
    first = stop_column(STOPS) + int(column)
    return matrix[:, first : first + pendulums * width : width]


def load_at_rest(matrix: Floats) -> Floats:
    """Mean torque in N*m up to which the load of each case of a matrix holds a shaft that stands, shape (cases,)."""
    load: Floats = matrix[:, Column.LOAD] + matrix[:, Column.STRIBECK] + matrix[:, TABLE_TORQUES.start]
    return load


def swings(matrix: Floats) -> NDArray[np.bool_]:
    """Whether the load of each case of a matrix swings with the angle of the shaft, shape (cases,)."""
    cyclic: NDArray[np.bool_] = matrix[:, Column.CYCLIC] > 0.0
    return cyclic


def bends(matrix: Floats) -> NDArray[np.bool_]:
    """Whether the load of each case of a matrix has a term that need not rise with the speed, shape (cases,)."""
    tabled = np.any(matrix[:, TABLE_TORQUES] > 0.0, axis=1)
    bent: NDArray[np.bool_] = swings(matrix) | (matrix[:, Column.STRIBECK] > 0.0) | tabled
    return bent


def unloaded(matrix: Floats, pendulums: int) -> NDArray[np.bool_]:
    """Whether nothing resists the shaft of each case of a matrix, so that every speed that no clutch changes lasts."""
    terms = (Column.LOAD, Column.BEARING, Column.LINEAR, Column.QUADRATIC, Column.STRIBECK)
    resisting = [*map(int, terms), *range(TABLE_TORQUES.start, TABLE_TORQUES.stop)]
    # A drive with drag in an overrunning clutch has a backstop.
    drags = of_pendulums(matrix, pendulums, PendulumColumn.OVERRUNNING_DAMPING)
    free: NDArray[np.bool_] = np.all(matrix[:, resisting] == 0.0, axis=1) & ~np.any(drags > 0.0, axis=1)
    return free


def turns_freely(matrix: Floats, pendulums: int) -> NDArray[np.bool_]:
    """Which pendulums have no spring, so that one that has turned over is where it was, shape (cases, pendulums)."""
    free: NDArray[np.bool_] = of_pendulums(matrix, pendulums, PendulumColumn.SPRING) == 0.0
    return free


def inertia_ratio(matrix: Floats, pendulums: int) -> Floats:
    """Inertia of the shaft of each case of a matrix over that of its pendulums together, shape (cases,)."""
    inertias = of_pendulums(matrix, pendulums, PendulumColumn.INERTIA)
    ratio: Floats = matrix[:, Column.INERTIA] / np.add.reduce(inertias, axis=1)
    return ratio


def _stop(time: Floats) -> tuple[Floats, Floats]:
    """Split times in periods into whole periods and a fraction in (0, 1]; time 0 is (0, 0)."""
    nearest = np.rint(time)
    time = np.where(np.abs(time - nearest) <= _WHOLE * np.maximum(1.0, nearest), nearest, time)
    whole = np.ceil(time) - 1.0
    start = time <= 0.0
    return np.where(start, 0.0, whole), np.where(start, 0.0, time - whole)


def case_matrix(columns: Mapping[str, ArrayLike], run: Run, cases: int) -> Floats:
    """Matrix of cases for the kernel.

    Parameters
    ----------
    columns : mapping
        Paths in a spec to scalars or arrays of shape (cases,), in SI units (frequency in Hz).
    run : Run
    cases : int

    Returns
    -------
    array, shape (cases, columns)
        `Column`: nu, period, d nu^2, b nu^2, chi, largest accelerations of the base in x and y, highest order of its
        harmonics, room for harmonics, g, M_c, lambda_e, k_1, k_2, M_s, 1/omega_s, kappa M_c, m, psi, J_e,
        1/rate, initial speed, step budget, and for kernels with ramps phase of the excitation in turns, its angular
        frequency and the rate of that, factor on the load and the rate of that; the table of the load; four stops; per
        pendulum `PendulumColumn`: M l/J,
        c a^2/J, lambda/J, 1/J, J, delta, u_end, lambda_k, lambda_o, initial angle, speed, windup and state of the
        clutch; its clutch coefficients. Per harmonic `HarmonicColumn`.
    """
    n, count = pendulum_count(columns), coefficient_count(columns)

    def column(path: str, default: float | None = None) -> Floats:
        value = columns.get(path, default)
        if value is None:
            raise ValueError(f"parameter {path} is missing")
        return np.broadcast_to(np.asarray(value, dtype=np.float64), (cases,))

    def parameter(path: str) -> Floats:
        return column(path, default_of(path))

    frequency = parameter("excitation.frequency")
    nu = 2.0 * math.pi * frequency
    shaft_inertia = parameter("shaft.inertia")
    # The fastest rate among the excitation, pendulums on their springs, and pendulums against the shaft through their
    # clutches; it converts accelerations to speeds in the error estimate of a step.
    rate = nu
    acc_x, acc_y = (parameter(f"excitation.amplitude_{direction}") * np.square(nu) for direction in "xy")
    vibrations, highest, overtones = _overtones(columns, cases, nu, (acc_x, acc_y))
    rate = rate * highest
    gravity = parameter("gravity")
    swing = np.zeros(cases)  # the fastest of the pendulums on what accelerates them
    pendulums: list[Floats] = []
    for i in range(n):
        own = {
            name: parameter(f"pendulums.{i}.{name}")
            for name in (
                "inertia", "mass", "arm", "spring_rate", "spring_arm", "damping", "backlash", "initial_angle",
                "initial_speed", "initial_windup", "initial_clutch", "clutch_damping", "overrunning_damping",
            )
        }  # fmt: skip
        inertia = own["inertia"]
        spring = own["spring_rate"] * np.square(own["spring_arm"]) / inertia
        rate = np.maximum(rate, np.sqrt(spring))
        moment = own["mass"] * own["arm"] / inertia
        swing = np.maximum(swing, np.sqrt(np.abs(moment) * (gravity + vibrations[0] + vibrations[1])))
        law = _law_prefix(columns, i)
        stiffness = np.maximum(column(f"{law}coefficients.1", 0.0), 0.0)
        rate = np.maximum(rate, np.sqrt(stiffness * (1.0 / inertia + 1.0 / shaft_inertia)))
        P = PendulumColumn
        values = {
            P.ML: moment, P.SPRING: spring, P.DAMPING: own["damping"] / inertia,
            P.INVERSE_INERTIA: 1.0 / inertia, P.INERTIA: inertia, P.BACKLASH: own["backlash"],
            P.LIMIT: column(f"{law}windup_limit", math.inf), P.ANGLE: own["initial_angle"],
            P.CLUTCH_DAMPING: own["clutch_damping"], P.OVERRUNNING_DAMPING: own["overrunning_damping"],
            P.SPEED: own["initial_speed"], P.WINDUP: own["initial_windup"], P.CLUTCH: own["initial_clutch"],
        }  # fmt: skip
        pendulums += [values[place] for place in P]
        pendulums += [column(f"{law}coefficients.{k}", 0.0) for k in range(count)]
    end_of_run = np.broadcast_to(run.duration.in_periods(frequency), (cases,))
    window_start, window_end = run.window_in_periods(frequency)
    # Seconds times frequency may round past the end of the run.
    end = np.minimum(window_end, end_of_run)
    start = np.minimum(window_start, end)
    whole = np.floor(end - start + 1e-9)
    # Without a whole period in the window its "start of whole periods" is its end, and there is no efficiency.
    times = (start, np.where(whole > 0, np.maximum(start, end - whole), end), end, end_of_run)
    cycles = end_of_run * np.maximum(1.0, np.minimum(np.maximum(rate, swing), _FASTEST_OWN) / nu)
    C = Column
    shaft = {
        C.NU: nu, C.PERIOD: 1.0 / frequency, C.ACC_X: acc_x, C.ACC_Y: acc_y,
        C.CHI: parameter("excitation.phase"),
        C.VIBRATION_X: vibrations[0], C.VIBRATION_Y: vibrations[1], C.HIGHEST_ORDER: highest,
        C.HARMONICS: np.full(cases, float(len(overtones) // HARMONIC_COLUMNS)),
        C.GRAVITY: gravity, C.LOAD: parameter("shaft.load"),
        C.BEARING: parameter("shaft.bearing_damping"), C.LINEAR: parameter("shaft.linear_load"),
        C.QUADRATIC: parameter("shaft.quadratic_load"), C.STRIBECK: parameter("shaft.stribeck_load"),
        C.STRIBECK_RATE: 1.0 / parameter("shaft.stribeck_speed"),
        C.CYCLIC: parameter("shaft.cyclic_load") * parameter("shaft.load"), C.CYCLES: parameter("shaft.load_cycles"),
        C.CYCLE: parameter("shaft.load_phase"),
        C.INERTIA: shaft_inertia, C.INVERSE_RATE: 1.0 / rate, C.SPEED: parameter("shaft.initial_speed"),
        C.MOST_STEPS: run.step_budget(cycles),
        C.PHASE: np.zeros(cases), C.PHASE_RATE: nu, C.PHASE_SLOPE: np.zeros(cases),
        C.LOAD_FACTOR: np.ones(cases), C.LOAD_SLOPE: np.zeros(cases),
    }  # fmt: skip
    stops = [part for time in times for part in _stop(time)]
    table = load_table(columns, cases)
    return np.ascontiguousarray(
        np.column_stack([*(shaft[place] for place in C), *table, *stops, *pendulums, *overtones])
    )


def _overtones(
    columns: Mapping[str, ArrayLike], cases: int, nu: Floats, plain: tuple[Floats, Floats]
) -> tuple[tuple[Floats, Floats], Floats, list[Floats]]:
    """Of a base with harmonics beside the accelerations ``plain``: bounds of the accelerations in x and y, the highest
    order, and the columns of all harmonics for which the kernel has room.
    """
    room = harmonic_room(columns)
    (x, y), highest, listed = plain, np.ones(cases), harmonics(columns, cases)
    for harmonic in listed:
        square = np.square(harmonic.order * nu)
        x, y = x + harmonic.amplitude_x * square, y + harmonic.amplitude_y * square
        moves = (harmonic.amplitude_x > 0.0) | (harmonic.amplitude_y > 0.0)
        highest = np.maximum(highest, np.where(moves, harmonic.order, 1.0))
    still = [np.zeros(cases)] * (HARMONIC_COLUMNS * (room - len(listed)))
    return (x, y), highest, [*(column for harmonic in listed for column in harmonic_columns(harmonic, nu)), *still]


def stop_column(stop: int) -> int:
    """The column of the whole periods of a stop; the next one has its fraction."""
    return SHAFT_COLUMNS + 2 * stop


def pendulum_column(coefficients: int, pendulum: int, column: int) -> int:
    """A column of a pendulum in a matrix whose clutches have that many coefficients."""
    return stop_column(STOPS) + pendulum * (PENDULUM_COLUMNS + coefficients) + column


def with_lengths(matrix: Floats, begin: Floats, periods: Floats, *, windowed: bool | NDArray[np.bool_]) -> Floats:
    """The same cases, each run for its own number of periods from its own starting phase.

    Parameters
    ----------
    matrix : array, shape (cases, columns)
        From ``case_matrix``.
    begin : array, shape (cases,)
        Part of the period at which a case begins.
    periods : array, shape (cases,)
        Whole periods that it runs.
    windowed : bool, or array of shape (cases,)
        Whether the characteristics are taken over all of the run, or not at all.
    """
    changed = matrix.copy()
    end = periods + begin
    first, last = _stop(np.where(windowed, begin, end)), _stop(end)
    for k, (whole, fraction) in enumerate((first, first, last, last)):
        changed[:, stop_column(k)] = whole
        changed[:, stop_column(k) + 1] = fraction
    return changed
