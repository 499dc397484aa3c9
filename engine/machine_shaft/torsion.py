"""Torsional vibration of a train with couplings: natural frequencies, and the answer to the torques of the cycle.

Bodies of the inertias J_0 .. J_m, reduced to the main shaft, are joined by m couplings of the stiffness k and the
relative damping psi; the last body has the mean inertia of the mechanism. The rigid motion gives the torque in each
coupling, M_d - (J_0 + .. + J_(k-1)) domega/dt, and each of its harmonics over time is answered by the elastic train
(W. Ker Wilson, *Practical Solution of Torsional Vibration Problems*; J. P. Den Hartog, *Mechanical Vibrations*,
chapter 5; docs/theory-machine-shaft.md, "Torsional vibration").
"""

from collections.abc import Mapping
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from sprag_study.engine import elementary
from sprag_study.engine.compile.jit import compiled, part
from sprag_study.engine.elementary.angles import cosine, sine
from sprag_study.engine.machine_shaft.decomposition import Decomposition
from sprag_study.engine.machine_shaft.drive_train import Chain
from sprag_study.engine.machine_shaft.kernels import solve_two
from sprag_study.engine.machine_shaft.panels import COEFFICIENTS, NODES, POSITIONS, WEIGHTS, apply

Floats = NDArray[np.float64]

#: Harmonics of the cycle that are computed first, and at most: at least the last number of them a revolution.
FIRST_ORDERS, MOST_ORDERS, ORDERS_A_TURN = 64, 512, 32
#: There are enough where the last one is that many times as fast as the highest natural frequency. There are enough
#: before, where the last quarter of them is that small a share of the largest, and all together have the mean square
#: of what excites the train (Parseval) but for that share.
_BEYOND, _SMALL, _LEFT = 8.0, 1e-11, 1e-12
#: Share of the largest harmonic of the torque in a coupling, rigid or elastic, from which another one counts.
EXCITING = 0.1
#: Share of the largest torque below which a torque is a rounding error.
_NOTHING = 1e-9
#: Radians of the last harmonic that the nodes of a panel resolve.
_RESOLVED = 12.0
#: Places of a cycle for each harmonic at which its torques are computed before their extremes are refined.
_PLACES = 4

RESULTS = ("natural_frequency", "order", "margin", "dynamic_factor", "coupling", "torque.amplitude", "reversals")
OF_COUPLING = ("torque.max", "torque.amplitude", "dynamic_factor")


class Signals(NamedTuple):
    """What excites the train of one case.

    Attributes
    ----------
    unit : array, shape (panels, nodes)
        Time as an angle: 2 pi at the end of the cycle.
    pace : array of that shape
        Weights of the mean over time, to be multiplied with those of the nodes.
    drive, acceleration : arrays of that shape
        Driving torque (N*m) and angular acceleration (rad/s^2) of the main shaft in the rigid motion.
    """

    unit: Floats
    pace: Floats
    drive: Floats
    acceleration: Floats


class CaseChain(NamedTuple):
    """The train of one case: inertias (m + 1,) in kg*m^2, stiffness (m,) in N*m/rad, and relative damping (m,)."""

    inertias: Floats
    stiffness: Floats
    damping: Floats


class Vibration(NamedTuple):
    """Torques in the couplings of one case, reduced to the main shaft.

    Attributes
    ----------
    natural : array, shape (m,)
        Natural frequencies in rad/s, ascending.
    mean : float
        Mean torque over time in N*m, in every coupling.
    rigid, elastic : arrays, shape (m, 2, orders)
        Coefficients of cos and sin of each harmonic of the cycle over time, of the rigid and of the elastic train.
    ends : array, shape (m, 2)
        Largest and smallest torque with the elastic train.
    """

    natural: Floats
    mean: float
    rigid: Floats
    elastic: Floats
    ends: Floats


def torsion_results(
    chain: Chain | None, d: Decomposition, known: Mapping[str, Floats], chosen: NDArray[np.bool_]
) -> dict[str, Floats]:
    """Results by name, each (cases,): ``torsion.*``, and ``couplings.K.*`` of each coupling.

    They are NaN without couplings, in cases that are not ``chosen``, and where a body has no inertia.
    """
    cases = len(d.squares)
    out = {f"torsion.{name}": np.full(cases, np.nan) for name in RESULTS}
    if chain is None:
        return out
    count = len(chain.stiffness)
    out |= {f"couplings.{k}.{name}": np.full(cases, np.nan) for k in range(count) for name in OF_COUPLING}
    total = sum(_row(inertia, cases) for inertia in chain.inertias)
    inertias = np.stack([_row(inertia, cases) for inertia in chain.inertias], axis=1)
    inertias[:, -1] += known["inertia.mean"] - total
    stiffness, damping, ratios, efficiencies = (
        np.stack([_row(own, cases) for own in values], axis=1)
        for values in (chain.stiffness, chain.damping, chain.ratios, chain.efficiencies)
    )
    pace = 1.0 / np.sqrt(d.squares)
    times, ends = d.panels.running(pace)
    period, acceleration = ends[:, -1], d.acceleration()
    before = np.cumsum(inertias, axis=1)
    extremes = [d.panels.extremes(d.drive.torque - before[:, k, None, None] * acceleration) for k in range(count)]
    rigid = np.stack([np.maximum(np.abs(own.highest), np.abs(own.lowest)) for own in extremes], axis=1)
    for case in np.nonzero(chosen & (inertias > 0.0).all(axis=1) & (period > 0.0) & np.isfinite(period))[0]:
        real = d.panels.half[case if len(d.panels.half) > 1 else 0] > 0.0
        half = d.panels.half[case if len(d.panels.half) > 1 else 0][real]
        signals = Signals(
            2.0 * np.pi / period[case] * times[case][real], half[:, None] / period[case] * pace[case][real],
            d.drive.torque[case][real], acceleration[case][real],
        )  # fmt: skip
        train = CaseChain(inertias[case], stiffness[case], damping[case])
        answer = answered(train, signals, 2.0 * np.pi / period[case], round(d.cycle / (2.0 * np.pi)))
        passed = efficiencies[case] if answer.mean >= 0.0 else 1.0 / efficiencies[case]
        own = _of_case(answer, 2.0 * np.pi / period[case], rigid[case], 1.0 / (ratios[case] * passed))
        for name, value in own.items():
            out[name][case] = value
    return out


def _row(values: Floats, cases: int) -> Floats:
    return np.broadcast_to(values[:, 0, 0], (cases,))


def _of_case(answer: Vibration, pace: float, rigid: Floats, own_shaft: Floats) -> dict[str, float]:
    """Results of one case: ``rigid`` are the largest torques with a rigid train, ``own_shaft`` the factors by which
    torques are those of the coupling's own shaft.
    """
    high, low = answer.ends.T
    peak = np.maximum(np.abs(high), np.abs(low))
    factor = np.where(rigid > 0.0, peak / np.where(rigid > 0.0, rigid, 1.0), np.nan)
    amplitude = 0.5 * (high - low) * own_shaft
    turns = (np.minimum(high, -low) > _NOTHING * peak).sum()
    out = {
        "torsion.natural_frequency": float(answer.natural[0]), "torsion.torque.amplitude": float(amplitude.max()),
        "torsion.reversals": float(turns),
    }  # fmt: skip
    if np.isfinite(factor).all():
        out |= {"torsion.dynamic_factor": float(factor.max()), "torsion.coupling": 1.0 + float(np.argmax(factor))}
    for k in range(len(peak)):
        values = (peak[k] * own_shaft[k], amplitude[k], factor[k])
        out |= {f"couplings.{k}.{name}": float(value) for name, value in zip(OF_COUPLING, values, strict=True)}
    exciting = np.zeros(answer.rigid.shape[2], dtype=np.bool_)
    for parts in (answer.rigid, answer.elastic):
        sizes = np.sqrt(np.square(parts[:, 0]) + np.square(parts[:, 1]))
        most = sizes.max(axis=1)[:, None]
        exciting |= ((sizes >= EXCITING * most) & (most > _NOTHING * rigid[:, None])).any(axis=0)
    orders = 1.0 + np.nonzero(exciting)[0]
    if orders.size:
        margins = np.abs(orders[:, None] * pace - answer.natural) / answer.natural
        nearest = margins.min(axis=1)
        out |= {"torsion.order": float(orders[np.argmin(nearest)]), "torsion.margin": float(nearest.min())}
    return out


def answered(train: CaseChain, signals: Signals, pace: float, turns: int) -> Vibration:
    """The steady answer of one train.

    Parameters
    ----------
    train : CaseChain
    signals : Signals
    pace : float
        Angular frequency of the cycle in rad/s.
    turns : int
        Revolutions of the cycle.
    """
    couplings = len(train.stiffness)
    natural = np.empty(couplings)
    natural_frequencies(train.inertias, train.stiffness, natural)
    before = np.cumsum(train.inertias)[:-1]
    most = max(MOST_ORDERS, ORDERS_A_TURN * turns)
    enough = min(most, FIRST_ORDERS * int(np.ceil(min(_BEYOND * natural[-1] / pace, most) / FIRST_ORDERS)))
    orders = FIRST_ORDERS
    while True:
        drive, acceleration, whole = _harmonics(signals, orders)
        mean = 0.5 * float(drive[0, 0])
        rigid = np.ascontiguousarray((drive - before[:, None, None] * acceleration)[..., 1:])
        elastic = np.empty_like(rigid)
        _amplified(train.inertias, train.stiffness, train.damping, pace, rigid, elastic)
        sizes = np.abs(elastic).max(axis=1)
        small = sizes[:, 3 * orders // 4 :].max(axis=1) <= _SMALL * np.maximum(sizes.max(axis=1), abs(mean))
        if (whole and small.all()) or orders >= enough:
            break
        orders = enough
    places = 2.0 * np.pi / (_PLACES * orders) * np.arange(_PLACES * orders)
    ends = np.empty((couplings, 2))
    _extremes(mean, elastic, elementary.cos(places), elementary.sin(places), ends)
    return Vibration(natural, mean, rigid, elastic, ends)


@lru_cache(maxsize=64)
def _finer(pieces: int) -> Floats:
    """From the nodes of a panel to those of its ``pieces`` equal parts, shape (pieces * NODES, NODES)."""
    starts = 2.0 / pieces * np.arange(pieces) - 1.0
    places = (starts[:, None] + (1.0 + POSITIONS) / pieces).ravel()
    powers = np.asarray(legendre.legvander(places, NODES - 1), dtype=np.float64)
    return apply(np.ascontiguousarray(COEFFICIENTS.T), powers)


def _harmonics(signals: Signals, orders: int) -> tuple[Floats, Floats, bool]:
    """Coefficients of cos and sin of driving torque and acceleration, from order 0: each of shape (2, orders + 1).

    The third value says whether they are all that there are. A panel is divided into as many parts as the last order
    needs.
    """
    width = 2.0 * (signals.unit[:, -1] - signals.unit[:, 0]) / (POSITIONS[-1] - POSITIONS[0])
    pieces = np.maximum(np.ceil(orders * width / _RESOLVED), 1.0).astype(np.int64)
    out, squares = np.zeros((2, 2, orders + 1)), np.zeros(2)
    for count in np.unique(pieces).tolist():
        unit, pace, drive, acceleration = (apply(_finer(count), own[pieces == count]).ravel() for own in signals)
        steps = np.tile(WEIGHTS, len(pace) // NODES) * pace / count
        _sums(np.stack([drive, acceleration]), elementary.cos(unit), elementary.sin(unit), steps, out, squares)
    left = np.empty(2)
    _left(out, squares, left)
    return out[0], out[1], bool((left <= _LEFT * squares).all())


@compiled
def _sums(values: Floats, cosine: Floats, sine: Floats, steps: Floats, out: Floats, squares: Floats) -> None:
    """Fourier coefficients of each row of ``values`` (rows, n), twice the mean first, added to ``out``
    (rows, 2, orders), and the mean square, added to ``squares`` (rows,).
    """
    count = len(steps)
    for row in range(len(values)):
        for j in range(count):
            squares[row] += steps[j] * values[row, j] * values[row, j]
    re, im = np.ones(count), np.zeros(count)
    for k in range(out.shape[2]):
        for row in range(len(values)):
            along, across = 0.0, 0.0
            for j in range(count):
                share = steps[j] * values[row, j]
                along += share * re[j]
                across += share * im[j]
            out[row, 0, k] += 2.0 * along
            out[row, 1, k] += 2.0 * across
        for j in range(count):
            turned = re[j] * cosine[j] - im[j] * sine[j]
            im[j] = re[j] * sine[j] + im[j] * cosine[j]
            re[j] = turned


@compiled
def _left(parts: Floats, squares: Floats, out: Floats) -> None:
    """Mean squares that the harmonics ``parts`` (rows, 2, orders) leave of ``squares``, both of shape (rows,)."""
    for row in range(len(parts)):
        out[row] = squares[row] - 0.25 * parts[row, 0, 0] * parts[row, 0, 0]
        for k in range(1, parts.shape[2]):
            out[row] -= 0.5 * (parts[row, 0, k] * parts[row, 0, k] + parts[row, 1, k] * parts[row, 1, k])


@compiled
def natural_frequencies(inertias: Floats, stiffness: Floats, out: Floats) -> None:
    """Natural frequencies in rad/s above 0, ascending, of bodies (m + 1,) joined by couplings (m,): ``out`` is (m,).

    The torques T in the couplings obey B T = w^2 T/k with a tridiagonal B, so that the motion of the whole train is not
    among the solutions. The number of those below w is that of the negative pivots (Sturm); bisection gives each.
    """
    count = len(stiffness)
    # The trace of the matrix is above every square of a natural frequency.
    top = 0.0
    for k in range(count):
        top += stiffness[k] * (1.0 / inertias[k] + 1.0 / inertias[k + 1])
    for mode in range(count):
        low, high = 0.0, 2.0 * np.sqrt(top)
        while True:
            middle = 0.5 * (low + high)
            if middle <= low or middle >= high:
                break
            below, pivot = 0, 1.0
            for k in range(count):
                joined = 0.0 if k == 0 else 1.0 / inertias[k] / inertias[k] / pivot
                pivot = 1.0 / inertias[k] + 1.0 / inertias[k + 1] - middle * middle / stiffness[k] - joined
                if pivot == 0.0:
                    pivot = -1e-300
                below += pivot < 0.0
            if below > mode:
                high = middle
            else:
                low = middle
        out[mode] = high


@compiled
def _amplified(inertias: Floats, stiffness: Floats, damping: Floats, pace: float, rigid: Floats, out: Floats) -> None:
    """Harmonics of the torques with the elastic train from those with a rigid one, both of shape (m, 2, orders).

    With phasors T = a - i b and the complex stiffness k (1 + i psi/(2 pi)), the difference D of the torques solves
    (B - W) D = W T_rigid, W = (n pace)^2/(k (1 + i psi/(2 pi))).
    """
    count = len(stiffness)
    matrix, right = np.empty((2 * count, 2 * count)), np.empty((2 * count, 2))
    for n in range(rigid.shape[2]):
        square = np.square((n + 1.0) * pace)
        matrix[:] = 0.0
        right[:] = 0.0
        for k in range(count):
            loss = damping[k] / (2.0 * np.pi)
            size = square / (stiffness[k] * (1.0 + loss * loss))
            re, im = size, -size * loss
            for row in (2 * k, 2 * k + 1):
                matrix[row, row] = 1.0 / inertias[k] + 1.0 / inertias[k + 1] - re
                if k:
                    matrix[row, row - 2] = -1.0 / inertias[k]
                if k + 1 < count:
                    matrix[row, row + 2] = -1.0 / inertias[k + 1]
            matrix[2 * k, 2 * k + 1] = im
            matrix[2 * k + 1, 2 * k] = -im
            a, b = rigid[k, 0, n], -rigid[k, 1, n]
            right[2 * k, 0] = re * a - im * b
            right[2 * k + 1, 0] = re * b + im * a
        solve_two(matrix, right)
        for k in range(count):
            out[k, 0, n] = rigid[k, 0, n] + right[2 * k, 0]
            out[k, 1, n] = rigid[k, 1, n] - right[2 * k + 1, 0]


@compiled
def _extremes(mean: float, parts: Floats, cosines: Floats, sines: Floats, out: Floats) -> None:
    """Largest and smallest value (m, 2) of the series with the coefficients ``parts`` (m, 2, orders).

    ``cosines`` and ``sines`` are those of equally spaced places of the cycle. Every place that is higher than its
    neighbours, and may be the highest, is refined by Newton's method.
    """
    places, orders = len(cosines), parts.shape[2]
    values = np.empty(places)
    for row in range(len(parts)):
        for i in range(places):
            total, j = mean, 0
            for n in range(orders):
                j += i
                if j >= places:
                    j -= places
                total += parts[row, 0, n] * cosines[j] + parts[row, 1, n] * sines[j]
            values[i] = total
        spread = values.max() - values.min()
        for end in range(2):
            sign = 1.0 - 2.0 * end
            most = (sign * values).max()
            best = most
            for i in range(places):
                here = sign * values[i]
                if (
                    here < most - 0.25 * spread
                    or here < sign * values[i - 1]
                    or (here < sign * values[(i + 1) % places])
                ):
                    continue
                best = max(best, sign * _refined(mean, parts[row], 2.0 * np.pi / places, i, sign))
            out[row, end] = sign * best


@part
def _refined(mean: float, parts: Floats, step: float, place: int, sign: float) -> float:
    """Value of a series (2, orders) at its extreme beside a place, by Newton's method; ``sign`` is -1 for a minimum."""
    u, value = step * place, 0.0
    for iteration in range(8):
        value, slope, curve = mean, 0.0, 0.0
        c, s = cosine(u), sine(u)
        re, im = c, s
        for n in range(parts.shape[1]):
            a, b, order = parts[0, n], parts[1, n], n + 1.0
            value += a * re + b * im
            slope += order * (b * re - a * im)
            curve -= order * order * (a * re + b * im)
            re, im = re * c - im * s, re * s + im * c
        if iteration == 7 or not sign * curve < 0.0:
            break
        u += min(max(-slope / curve, -step), step)
    return value
