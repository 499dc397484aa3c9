"""The forces of one case over one turn of its settled motion, or over the window of a run (docs/theory.md, "Forces").

Speeds and clutch torques are the polynomials of the integration's steps; angles are their integrals, accelerations
follow from the equations of motion. Means are Gaussian quadratures over each step, extremes are located inside steps.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine import elementary
from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.outcome import Forces, Trajectory
from sprag_study.engine.quadrature import gauss
from sprag_study.engine.run import Run, SettledRun
from sprag_study.engine.vibration_drive.cases import (
    Harmonic,
    case_matrix,
    default_of,
    harmonic_columns,
    harmonics,
    scalars,
    with_lengths,
)
from sprag_study.engine.vibration_drive.examined import examined_window, read_steps
from sprag_study.engine.vibration_drive.force_results import Bearing, force_infos
from sprag_study.engine.vibration_drive.formulas import base_series, drive, free_acceleration, harmonic_series
from sprag_study.engine.vibration_drive.kernel import kernel_of
from sprag_study.engine.vibration_drive.layout import PendulumSample
from sprag_study.engine.vibration_drive.pieces import CLOSER, PLACES, Pieces, polynomials
from sprag_study.engine.vibration_drive.regimes import Regime
from sprag_study.engine.vibration_drive.settle import SettledBatch, settle
from sprag_study.engine.vibration_drive.strobes import BEGIN

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
#: Nodes of a step's quadrature. It is exact up to degree 31, beyond the square of a step's series.
_GAUSS = gauss(16)
_NODES, _WEIGHTS = 0.5 * (1.0 + _GAUSS[0]), 0.5 * _GAUSS[1]


def forces(columns: Mapping[str, ArrayLike], run: Run, bearing: Bearing, points: int = 0) -> Forces:
    """The forces in the window of a run, of a run longer than ``MAX_PERIODS`` in its last periods at most.

    Parameters
    ----------
    columns : mapping
        As for ``simulate``, scalars only.
    run : Run
    bearing : Bearing
    points : int
        Samples of the forces over time.

    Raises
    ------
    ValueError
        If a required parameter is missing or the number of pendulums or coefficients is out of range.
    """
    values = scalars(columns)
    start, end = examined_window(run, values["excitation.frequency"])
    since = float(np.floor(start))
    matrix = case_matrix(values, run, 1)
    return _forces(values, run, matrix, None, (since, start, end), bearing, points, "")


def settled_forces(
    columns: Mapping[str, ArrayLike], settings: SettledRun, bearing: Bearing, points: int, start: Floats | None = None
) -> Forces:
    """The forces over one turn of the settled motion; of one without an orbit over ``settings.max_period`` periods.

    Parameters
    ----------
    columns : mapping
        As for ``simulate``, scalars only.
    settings : SettledRun
    bearing : Bearing
    points : int
        Samples of the forces over time. Times count from the start of an excitation period.
    start : array, shape (1, strobes.width(n)), optional
        As ``starts`` of ``settle``; without it the case's own start.

    Raises
    ------
    ValueError
        If a required parameter is missing or the number of pendulums or coefficients is out of range.
    """
    values = scalars(columns)
    return forces_of_motion(values, settings, settle(values, settings, cases=1, starts=start), bearing, points)


def forces_of_motion(
    values: Mapping[str, float], settings: SettledRun, motion: SettledBatch, bearing: Bearing, points: int = 0
) -> Forces:
    """The forces of the settled motion of one case, which ``settle`` has given, as `settled_forces`."""
    regime, ending = Regime(int(motion.regimes[0])), ENDINGS[int(motion.endings[0])]
    if ending is not Ending.OK:
        return _nothing(ending, regime.name.lower())
    turn = int(motion.orders[0]) if regime.repeats else settings.max_period
    run = settings.fine if regime.repeats else settings.run
    begin = float(motion.points[0, BEGIN])
    first = float(np.ceil(begin))
    length = np.array([first + turn - begin])
    matrix = with_lengths(case_matrix(values, run, 1), np.array([begin]), length, windowed=False)
    span = (first, first, first + turn)
    return _forces(values, run, matrix, motion.points, span, bearing, points, regime.name.lower())


def _nothing(ending: Ending, regime: str) -> Forces:
    return Forces(0.0, 0.0, regime, (), {}, Trajectory(np.empty(0), (), (), np.empty((0, 0)), {}, ending), ending)


def _forces(
    values: Mapping[str, float], run: Run, matrix: Floats, starts: Floats | None, span: tuple[float, float, float],
    bearing: Bearing, points: int, regime: str,
) -> Forces:  # fmt: skip
    """The forces of a call of the kernel from the second to the third time of ``span``, of which the first is the
    start of the excitation period of the second.
    """
    since, start, end = span
    module = kernel_of(values, run.tolerance)
    record = read_steps(module, matrix, run, since, end - since, starts=starts)
    if record.ending is not Ending.OK:
        return _nothing(record.ending, regime)
    angles = record.of_pendulums(PendulumSample.ANGLE)
    machine = _Motion.read(values, record.steps.between(since, end), angles, bearing.shaft_mass).after(start)
    period = 1.0 / values["excitation.frequency"]
    # Times of a turn count from the start of an excitation period.
    zero = start if starts is not None else 0.0
    infos = force_infos(machine.n)
    results = _results(machine, values, bearing)
    return Forces(
        (start - zero) * period, (end - zero) * period, regime, infos,
        {info.name: results[info.name] for info in infos},
        _sampled(machine, np.linspace(start, end, points), zero, period), record.ending,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Body:
    """The pendulums: arrays of shape (n, 1, 1), so that they meet values of all of them at places of steps.

    ``ml``, ``spring`` and ``damping`` are M l, c a^2 and lambda over the inertia.
    """

    mass: Floats
    moment: Floats
    inertia: Floats
    ml: Floats
    spring: Floats
    damping: Floats

    @classmethod
    def read(cls, values: Mapping[str, float], n: int) -> "_Body":
        def column(name: str) -> Floats:
            paths = [f"pendulums.{i}.{name}" for i in range(n)]
            return np.array([_value(values, path) for path in paths])[:, np.newaxis, np.newaxis]

        mass, inertia = column("mass"), column("inertia")
        moment = mass * column("arm")
        spring = column("spring_rate") * np.square(column("spring_arm"))
        return cls(mass, moment, inertia, moment / inertia, spring / inertia, column("damping") / inertia)


def _value(values: Mapping[str, float], path: str) -> float:
    value = values.get(path, default_of(path))
    if value is None:
        raise ValueError(f"parameter {path} is missing")
    return float(value)


@dataclass(frozen=True, slots=True)
class _Instant:
    """What moves at places of steps: of the base velocity and acceleration in x and y, shapes (steps, places); of the
    pendulums angle, force on the table in x and y, and momentum, shapes (n, steps, places); of the shaft the speed.
    """

    velocity: tuple[Floats, Floats]
    acceleration: tuple[Floats, Floats]
    angle: Floats
    x: Floats
    y: Floats
    momentum: tuple[Floats, Floats]
    shaft: Floats


@dataclass(frozen=True, slots=True)
class _Motion:
    """The steps of a motion, and the angles of the pendulums at the start of each, shape (steps, n)."""

    pieces: Pieces
    angles: Floats
    bodies: _Body
    shaft_mass: float
    nu: float
    base: tuple[float, float, float]
    harmonics: list[Harmonic]
    gravity: float

    @classmethod
    def read(cls, values: Mapping[str, float], pieces: Pieces, first: Floats, shaft_mass: float) -> "_Motion":
        n = len(first)
        whole = np.ones((len(pieces.length), 1))
        turned = pieces.length[:, np.newaxis] * _primitives(pieces.speeds.swapaxes(0, 1), whole)[:, :, 0].T
        angles = first + np.vstack([np.zeros((1, n)), np.cumsum(turned, axis=0)[:-1]])
        nu = 2.0 * math.pi * values["excitation.frequency"]
        base = tuple(_value(values, f"excitation.{name}") for name in ("amplitude_x", "amplitude_y", "phase"))
        return cls(
            pieces, angles, _Body.read(values, n), shaft_mass, nu, (base[0], base[1], base[2]),
            harmonics(values, 1), _value(values, "gravity"),
        )  # fmt: skip

    def after(self, start: float) -> "_Motion":
        """The steps after a time (in excitation periods) at which a step begins."""
        kept = self.pieces.between(start, math.inf)
        return _Motion(
            kept, self.angles[len(self.angles) - len(kept.length) :], self.bodies, self.shaft_mass, self.nu, self.base,
            self.harmonics, self.gravity,
        )  # fmt: skip

    @property
    def n(self) -> int:
        """Number of pendulums."""
        return int(self.angles.shape[1])

    def at(self, steps: Ints, x: Floats) -> _Instant:
        """What moves in steps (shape (s,)) at the places ``x`` (shape (s, places)), in fractions of each step."""
        pieces, bodies = self.pieces, self.bodies
        length = pieces.length[steps][:, np.newaxis]
        fraction = (pieces.start - pieces.whole)[steps][:, np.newaxis] + x * length * (self.nu / (2.0 * math.pi))
        turned = 2.0 * math.pi * fraction
        velocity, acceleration = self._base(turned)
        ax, ay = acceleration
        speed = polynomials(pieces.speeds[steps].swapaxes(0, 1), x)
        torque = polynomials(pieces.torques[steps].swapaxes(0, 1), x)
        angle = self.angles[steps].T[:, :, np.newaxis] + length * _primitives(pieces.speeds[steps].swapaxes(0, 1), x)
        sin, cos = elementary.sin(angle), elementary.cos(angle)
        driven = drive([ax], [ay], [sin], [cos], 0)
        free = free_acceleration(
            bodies.ml, bodies.ml * self.gravity, bodies.spring, bodies.damping, angle, speed, sin, driven
        )
        gained = free - torque / bodies.inertia
        swing = np.square(speed)
        return _Instant(
            velocity,
            acceleration,
            angle,
            -bodies.mass * ax + bodies.moment * (gained * cos - swing * sin),
            -bodies.mass * (ay + self.gravity) + bodies.moment * (gained * sin + swing * cos),
            (
                bodies.mass * velocity[0] - bodies.moment * speed * cos,
                bodies.mass * velocity[1] - bodies.moment * speed * sin,
            ),
            polynomials(pieces.speed[steps], x),
        )

    def _base(self, turned: Floats) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
        """Velocity and acceleration of the base in x and y where its vibration has turned by an angle in rad."""
        d, b, chi = self.base
        sin_chi, cos_chi = (np.full_like(turned, float(f(chi))) for f in (elementary.sin, elementary.cos))
        square = self.nu * self.nu
        amplitudes = np.full_like(turned, d * square), np.full_like(turned, b * square)
        nu = np.full_like(turned, self.nu)
        (ax, jerk_x), (ay, jerk_y) = base_series(
            *amplitudes, nu, elementary.sin(turned), elementary.cos(turned), sin_chi, cos_chi
        )
        vx, vy = -jerk_x / square, -jerk_y / square
        for harmonic in self.harmonics:
            order, x_cos, x_sin, y_cos, y_sin = harmonic_columns(harmonic, np.array([self.nu]))
            rate, angle = order * self.nu, order * turned
            sin, cos = elementary.sin(angle), elementary.cos(angle)
            (x, by_x), (y, by_y) = harmonic_series(x_cos, x_sin, y_cos, y_sin, rate, sin, cos)
            vx, vy = vx - by_x / (rate * rate), vy - by_y / (rate * rate)
            ax, ay = ax + x, ay + y
        return (vx, vy), (ax, ay)

    def on_table(self, now: _Instant) -> tuple[Floats, Floats]:
        """Force in N of all pendulums and of the shaft on the table, in x and y."""
        x, y = now.acceleration
        return (
            np.sum(now.x, axis=0) - self.shaft_mass * x,
            np.sum(now.y, axis=0) - self.shaft_mass * (y + self.gravity),
        )


def _primitives(series: Floats, x: Floats) -> Floats:
    """Integrals of series from the start of their steps, as ``polynomials``, in fractions of the step."""
    return x * polynomials(series / np.arange(1, series.shape[-1] + 1), x)


def _magnitude(x: Floats, y: Floats) -> Floats:
    return np.asarray(np.sqrt(np.square(x) + np.square(y)))


def _results(motion: _Motion, values: Mapping[str, float], bearing: Bearing) -> dict[str, float]:
    steps = np.arange(len(motion.pieces.length))
    out = dict.fromkeys((info.name for info in force_infos(motion.n)), math.nan)
    if not len(steps):
        return out
    time = float(np.sum(motion.pieces.length))
    now = motion.at(steps, np.tile(_NODES, (len(steps), 1)))

    def mean(of: Floats) -> float:
        return float(np.sum(motion.pieces.length * np.sum(of * _WEIGHTS, axis=1))) / time

    total = motion.on_table(now)
    bodies = {f"pendulums.{i}": (now.x[i], now.y[i]) for i in range(motion.n)} | {"table": total}
    for name, (x, y) in bodies.items():
        for direction, of in (("x", x), ("y", y)):
            out[f"{name}.force_{direction}.mean"] = mean(of)
            out[f"{name}.force_{direction}.rms"] = math.sqrt(mean(np.square(of)))
        out[f"{name}.force.rms"] = math.sqrt(mean(np.square(x) + np.square(y)))
    for direction, force, velocity in zip("xy", total, now.velocity, strict=True):
        out[f"excitation.power_{direction}.mean"] = -mean(force * velocity)
    _extremes(motion, steps, out)
    _springs(motion.n, values, out)
    _bearing(bearing, _magnitude(*total), mean, now.shaft, out)
    out["balance.force"] = _residual(motion, time, out)
    return out


def _extremes(motion: _Motion, steps: Ints, out: dict[str, float]) -> None:
    """Put the extremes of the forces, of the powers and (for the springs) of the angles."""
    n = motion.n

    def every(chosen: Ints, x: Floats) -> Floats:
        now = motion.at(chosen, x)
        total = motion.on_table(now)
        forces_x, forces_y = np.vstack([now.x, total[:1]]), np.vstack([now.y, total[1:]])
        powers = [-force * velocity for force, velocity in zip(total, now.velocity, strict=True)]
        return np.vstack([forces_x, forces_y, _magnitude(forces_x, forces_y), now.angle, powers])

    names = [*(f"pendulums.{i}" for i in range(n)), "table"]
    wanted = [f"{name}.force_{direction}" for direction in "xy" for name in names]
    wanted += [*(f"{name}.force" for name in names), *(f"pendulums.{i}.angle" for i in range(n))]
    wanted += [f"excitation.power_{direction}" for direction in "xy"]
    ends = [
        (place, end, sign)
        for place, name in enumerate(wanted)
        for end, sign in (("max", 1.0), ("min", -1.0))
        if end == "max" or not name.endswith((".force", "power_x", "power_y"))
    ]
    places, signs = np.array([place for place, _, _ in ends]), np.array([sign for _, _, sign in ends])
    extremes = _largest(steps, every, places, signs).tolist()
    for (place, end, sign), value in zip(ends, extremes, strict=True):
        out[f"{wanted[place]}.{end}"] = sign * value


def _largest(steps: Ints, every: Callable[[Ints, Floats], Floats], places: Ints, signs: Floats) -> Floats:
    """Largest values of some quantities on all steps, shape (quantities,).

    Parameters
    ----------
    steps : int array, shape (steps,)
    every : function
        The values of all quantities, shape (all, s, places), in steps (shape (s,)) at places (shape (s, places)) in
        fractions of each.
    places, signs : arrays, shape (quantities,)
        Which of all they are, and the signs with which they count.
    """
    last = len(PLACES) - 1
    grid = signs[:, np.newaxis, np.newaxis] * every(steps, np.tile(PLACES, (len(steps), 1)))[places]
    at, best = np.argmax(grid, axis=2), np.max(grid, axis=2)
    # Between the places a smooth quantity rises above the best of them by less than it falls off to the places around.
    # At an edge the place beside may be as good, with the peak between both: so the next one counts too.
    around = np.stack([np.maximum(at - 2, 0), np.minimum(at + 2, last)], axis=2)
    lowest = np.min(np.take_along_axis(grid, around, axis=2), axis=2)
    largest = np.max(best, axis=1)
    which, chosen = np.nonzero(best + (best - lowest) >= largest[:, np.newaxis])
    at, pairs = at[which, chosen], np.arange(len(which))
    low, high = PLACES[np.maximum(at - 1, 0)], PLACES[np.minimum(at + 1, last)]
    for _ in range(CLOSER):
        x = low[:, np.newaxis] + (high - low)[:, np.newaxis] * PLACES
        seen = signs[which, np.newaxis] * every(steps[chosen], x)[places[which], pairs]
        at = np.argmax(seen, axis=1)
        np.maximum.at(largest, which, seen[pairs, at])
        low, high = x[pairs, np.maximum(at - 1, 0)], x[pairs, np.minimum(at + 1, last)]
    return np.asarray(largest)


def _springs(n: int, values: Mapping[str, float], out: dict[str, float]) -> None:
    """Put the ranges of the springs' forces and moments, from those of the angles, which go."""
    for i in range(n):
        rate, arm = (_value(values, f"pendulums.{i}.{name}") for name in ("spring_rate", "spring_arm"))
        angles = [out.pop(f"pendulums.{i}.angle.{end}") for end in ("min", "max")]
        for name, factor in (("force", rate * abs(arm)), ("moment", rate * arm * arm)):
            for end, angle in zip(("min", "max"), angles, strict=True):
                out[f"pendulums.{i}.spring.{name}.{end}"] = factor * angle


def _bearing(
    bearing: Bearing, load: Floats, mean: Callable[[Floats], float], speed: Floats, out: dict[str, float]
) -> None:
    """Put the load and the life of the bearing that carries the largest part of the force ``load``."""
    out["bearing.load.max"] = bearing.share * out["table.force.max"]
    out["bearing.load.rms"] = bearing.share * out["table.force.rms"]
    x, y = (out[f"table.force_{direction}.mean"] for direction in "xy")
    size = math.sqrt(x * x + y * y)
    out["bearing.load.mean"] = bearing.share * size
    # A mean that is a rounding error of the largest force has no direction.
    if size > 1e-9 * out["table.force.max"]:
        out["bearing.load.direction"] = float(elementary.arctan2(y, x))
    turning = np.abs(speed)
    rate = mean(turning)
    if not rate > 0.0:
        return
    weighted = mean(turning * elementary.power(load, bearing.exponent)) / rate
    equivalent = bearing.share * float(elementary.power(weighted, 1.0 / bearing.exponent))
    out["bearing.equivalent_load"] = equivalent
    if bearing.rating > 0.0 and equivalent > 0.0:
        life = 1e6 * float(elementary.power(bearing.rating / equivalent, bearing.exponent))
        out["bearing.rating_life.revolutions"] = life
        out["bearing.rating_life.time"] = 2.0 * math.pi * life / rate


def _residual(motion: _Motion, time: float, out: Mapping[str, float]) -> float:
    """How far the mean force of all pendulums misses their weight and the change of their momentum, over the largest
    force.
    """
    steps = np.arange(len(motion.pieces.length))
    ends = [motion.at(steps[place], np.array([[x]])) for place, x in ((slice(0, 1), 0.0), (slice(-1, None), 1.0))]
    missed = 0.0
    for k, direction in enumerate("xy"):
        gained = float(np.sum(ends[1].momentum[k] - ends[0].momentum[k])) / time
        weight = float(np.sum(motion.bodies.mass)) * motion.gravity if direction == "y" else 0.0
        mean = math.fsum(out[f"pendulums.{i}.force_{direction}.mean"] for i in range(motion.n))
        missed = max(missed, abs(mean + weight + gained))
    largest = max(out[f"pendulums.{i}.force.max"] for i in range(motion.n))
    return missed / largest if largest > 0.0 else 0.0


def _sampled(motion: _Motion, times: Floats, zero: float, period: float) -> Trajectory:
    """The forces over time, at times in excitation periods; at a transition the values before it."""
    bodies = ("table", *(f"pendulums.{i}" for i in range(motion.n)))
    names = [f"{name}.force_{direction}" for name in bodies for direction in "xy"]
    units = ("N",) * len(names)
    if not len(motion.pieces.length):
        return Trajectory(np.empty(0), tuple(names), units, np.empty((0, len(names))), {}, Ending.OK)
    steps = np.clip(np.searchsorted(motion.pieces.end, times), 0, len(motion.pieces.length) - 1)
    x = np.clip((times - motion.pieces.start[steps]) * period / motion.pieces.length[steps], 0.0, 1.0)
    now = motion.at(steps, x[:, np.newaxis])
    columns = [*motion.on_table(now), *(force[i] for i in range(motion.n) for force in (now.x, now.y))]
    values = np.column_stack([column[:, 0] for column in columns])
    return Trajectory((times - zero) * period, tuple(names), units, values, {}, Ending.OK)
