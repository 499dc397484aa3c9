"""Compiled integration of a transient over time, from panel to panel of the cycle.

With u = sqrt(2 T) = omega sqrt(I) the motion is

    du/dt = M(phi, omega)/sqrt(I(phi)),   dphi/dt = u/sqrt(I(phi)),

which needs no derivative of the inertia and is regular at rest. Every step is Gauss's collocation with 12 nodes (order
24; E. Hairer, S. P. Norsett, G. Wanner, *Solving Ordinary Differential Equations I*, section II.7), solved by
iteration. It keeps quadratic invariants, so the energy is the work done to rounding. A step ends at the end of its
panel (its length is then an unknown, too), or is as long as the iteration allows.

Arrays are C-contiguous float64. Positions in a panel are -1 .. 1.
"""

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.compile.jit import compiled, part
from sprag_study.engine.machine_shaft.kernels import series_value

Floats = NDArray[np.float64]

#: How a transient ends.
REACHED, STOPPED, NOT_STARTED, TURNED, EXHAUSTED = range(5)
#: Rows of the table of a panel; the resisting torque has one or more rows, by the speed.
INERTIA, DRIVE, TARGET, RESISTANCE = range(4)
#: Numbers of a run: the motor's kind (0 none, 1 linear, 2 Kloss, 3 a table), its three numbers (of a table the unit of
#: its speeds and the factor on its torques), the efficiency behind it, the speed to which the rows of the resisting
#: torque extend, the factor on the target's sqrt(2 T), the side from which it is approached (0: no target), the
#: largest angle.
KIND, FIRST, SECOND, THIRD, EFFICIENCY, FASTEST, FACTOR, SIDE, FARTHEST = range(9)
#: Totals of a run.
WORK_DRIVE, WORK_RESISTANCE, WORK_SLIP, SPEED_MAX, SPEED_MIN, TORQUE_MAX, POWER_MAX = range(7)
TIME, ANGLE, ENERGY, STEPS, TOTALS = range(7, 12)
#: The state: number of the panel, position in it, u, time, angle at which its cycle began.
PANEL, PLACE, ROOT, CLOCK, CYCLES = range(5)
#: Rows of the values at the nodes of a step.
X, U, FX, FU, POWER_D, POWER_R, POWER_S, TORQUE, OMEGA, SPARE, ROWS = range(11)

_MOST_SWEEPS, _MOST_STEPS = 50, 2_000_000
#: Last two Legendre coefficients of the rates, relative to the change of a step.
_TAIL = 1e-12


@part
def chebyshev(c: Floats, x: float) -> float:
    """Chebyshev series ``c`` at ``x``, by Clenshaw's recurrence."""
    b1 = b2 = 0.0
    for k in range(len(c) - 1, 0, -1):
        b1, b2 = c[k] + 2.0 * x * b1 - b2, b1
    total: float = c[0] + x * b1 - b2
    return total


@part
def resisting(table: Floats, x: float, omega: float, fastest: float) -> float:
    """Resisting torque of a panel: one Chebyshev series over the angle for each term over the speed."""
    count = table.shape[0] - RESISTANCE
    if count == 1:
        return chebyshev(table[RESISTANCE], x)
    z = 2.0 * omega / fastest - 1.0
    b1 = b2 = 0.0
    for k in range(count - 1, 0, -1):
        b1, b2 = chebyshev(table[RESISTANCE + k], x) + 2.0 * z * b1 - b2, b1
    total: float = chebyshev(table[RESISTANCE], x) + z * b1 - b2
    return total


@part
def tabulated(pieces: Floats, omega: float) -> float:
    """Value at ``omega`` of cubic pieces: rows of the end of a piece, the speed that it counts from, four powers."""
    row = 0
    while omega >= pieces[row, 0]:
        row += 1
    d = omega - pieces[row, 1]
    value: float = pieces[row, 2] + d * (pieces[row, 3] + d * (pieces[row, 4] + d * pieces[row, 5]))
    return value


@part
def motor_pull(run: Floats, pieces: Floats, omega: float) -> tuple[float, float]:
    """Torque of the motor on the main shaft behind the losses, and the power lost to its slip, in W."""
    if run[KIND] == 1.0:
        own, slip_power = run[SECOND] * (1.0 - omega / run[FIRST]), 0.0
    elif run[KIND] == 2.0:
        slip = 1.0 - omega / run[FIRST]
        own = 2.0 * run[SECOND] * run[THIRD] * slip / (slip * slip + run[THIRD] * run[THIRD])
        slip_power = own * slip * run[FIRST]
    elif run[KIND] == 3.0:
        own, slip_power = run[SECOND] * tabulated(pieces, omega / run[FIRST]), 0.0
    else:
        return 0.0, 0.0
    return own * run[EFFICIENCY] if own >= 0.0 else own / run[EFFICIENCY], slip_power


@part
def rates(table: Floats, half: float, run: Floats, pieces: Floats, v: Floats, j: int) -> None:
    """Rates and powers at node ``j`` of the values ``v``."""
    x, u = v[X, j], v[U, j]
    root = np.sqrt(chebyshev(table[INERTIA], x))
    omega = u / root
    pull, slip_power = motor_pull(run, pieces, omega)
    drive = chebyshev(table[DRIVE], x) + pull
    load = resisting(table, x, omega, run[FASTEST])
    v[FX, j] = omega / half
    v[FU, j] = (drive + load) / root
    v[POWER_D, j], v[POWER_R, j], v[POWER_S, j] = drive * omega, load * omega, slip_power
    v[TORQUE, j], v[OMEGA, j] = drive, omega


@part
def total_of(weights: Floats, values: Floats) -> float:
    """The weighted sum of the values at the nodes."""
    total = 0.0
    for j in range(len(weights)):
        total += weights[j] * values[j]
    return total


@part
def collocate(
    table: Floats, half: float, run: Floats, pieces: Floats, x0: float, u0: float, h: float, lands: bool,
    running: Floats, weights: Floats, tail: Floats, v: Floats,
) -> tuple[float, int]:  # fmt: skip
    """Solve one step of the length ``h``, or to the end of the panel; its length and sweeps, 0 sweeps if it failed."""
    nodes = len(weights)
    for j in range(nodes):
        v[X, j], v[U, j] = x0, u0
    before = np.inf
    for sweep in range(1, _MOST_SWEEPS + 1):
        for j in range(nodes):
            rates(table, half, run, pieces, v, j)
        if lands:
            pace = total_of(weights, v[FX])
            if sweep > 2:
                if not pace > 0.0:
                    return h, 0
                h = 2.0 * (1.0 - x0) / pace
        change, most = 0.0, abs(u0)
        for i in range(nodes):
            x, u = 0.0, 0.0
            for j in range(nodes):
                x += running[i, j] * v[FX, j]
                u += running[i, j] * v[FU, j]
            x, u = min(max(x0 + 0.5 * h * x, -1.1), 1.1), u0 + 0.5 * h * u
            most = max(most, abs(u))
            change = max(change, abs(x - v[X, i]))
            v[SPARE, i] = abs(u - v[U, i])
            v[X, i], v[U, i] = x, u
        for i in range(nodes):
            change = max(change, v[SPARE, i] / most if most > 0.0 else 0.0)
        if not change < 1e3 or (sweep > 8 and change > before):
            if change < 1e-13:
                break
            return h, 0
        if change < 1e-15 or (change < 1e-13 and change >= 0.5 * before):
            break
        before = change
    else:
        return h, 0
    for j in range(nodes):
        rates(table, half, run, pieces, v, j)
    rough = 0.0
    for k in range(2):
        rough = max(rough, 0.5 * h * abs(total_of(tail[k], v[FX])))
        rough = max(rough, 0.5 * h * abs(total_of(tail[k], v[FU])) / most if most > 0.0 else 0.0)
    return (h, sweep) if rough <= _TAIL else (h, 0)


@part
def integral_to(values: Floats, h: float, s: float, to_integral: Floats, scratch: Floats) -> float:
    """Integral of the polynomial through the ``values`` at the nodes from the start of a step to its place ``s``."""
    for k in range(to_integral.shape[0]):
        scratch[k] = total_of(to_integral[k], values)
    return 0.5 * h * series_value(scratch, to_integral.shape[0], s)


@part
def peak(values: Floats, best: float, places: Floats, to_series: Floats, scratch: Floats) -> float:
    """The larger of ``best`` and the largest value of the polynomial through the ``values`` at the nodes of a step."""
    nodes = len(values)
    for k in range(nodes):
        scratch[k] = total_of(to_series[k], values)
    low, high, top, where = np.inf, -np.inf, 0.0, 0
    for k in range(nodes + 2):
        value = series_value(scratch, nodes, places[k])
        low = min(low, value)
        if value > high:
            high, where = value, k
    best = max(best, high)
    if 0 < where < nodes + 1 and high + 0.1 * (high - low) > best:
        a, b = places[where - 1], places[where + 1]
        for _ in range(44):  # golden section
            c, d = b - 0.6180339887498949 * (b - a), a + 0.6180339887498949 * (b - a)
            fc, fd = series_value(scratch, nodes, c), series_value(scratch, nodes, d)
            top = max(fc, fd)
            best = max(best, top)
            if fc > fd:
                b = d
            else:
                a = c
    return best


@part
def ahead(
    table: Floats, half: float, run: Floats, pieces: Floats, x0: float, u0: float, hint: float, v: Floats
) -> tuple[float, bool]:
    """A first guess of the length of a step, and whether that leads to the end of the panel; 0 where nothing moves."""
    v[X, 0], v[U, 0] = x0, u0
    rates(table, half, run, pieces, v, 0)
    pace = v[FX, 0]
    gain = v[FU, 0] / np.sqrt(chebyshev(table[INERTIA], x0)) / half
    if pace <= 0.0 and gain <= 0.0:
        return 0.0, False
    left = 1.0 - x0
    square = pace * pace + 2.0 * gain * left
    if square > 0.0:
        h = 2.0 * left / (pace + np.sqrt(square))
        return (h, True) if h <= hint else (hint, False)
    return min(hint, -1.2 * pace / gain), False


@part
def off_target(table: Floats, run: Floats, x: float, u: float) -> float:
    """How far sqrt(2 T) is on the side of the target from which it comes; not positive when it is reached."""
    left: float = run[SIDE] * (run[FACTOR] * np.sqrt(2.0 * chebyshev(table[TARGET], x)) - u)
    return left


@part
def event_time(
    table: Floats, run: Floats, h: float, x0: float, u0: float, stops: bool,
    to_integral: Floats, v: Floats, scratch: Floats,
) -> float:  # fmt: skip
    """Time within a step at which the shaft stops, or reaches the target, by bisection."""
    low, high = 0.0, h
    for _ in range(60):
        middle = 0.5 * (low + high)
        s = 2.0 * middle / h - 1.0
        u = u0 + integral_to(v[FU], h, s, to_integral, scratch)
        if stops:
            before = u > 0.0
        else:
            x = x0 + integral_to(v[FX], h, s, to_integral, scratch)
            before = off_target(table, run, x, u) > 0.0
        if before:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@part
def solve_step(
    table: Floats, half: float, run: Floats, pieces: Floats, x0: float, u0: float, h: float, lands: bool, hint: float,
    running: Floats, weights: Floats, tail: Floats, v: Floats,
) -> tuple[float, float, bool]:  # fmt: skip
    """A step as long as it can be: its length, the hint for the next one, and whether it lands; 0 if none is."""
    least = 1e-13 * h
    while h > least:
        solved, sweeps = collocate(table, half, run, pieces, x0, u0, h, lands, running, weights, tail, v)
        if sweeps > 0:
            low = v[U, 0]
            for j in range(len(weights)):
                low = min(low, v[U, j])
            forward = u0 + 0.5 * solved * total_of(weights, v[FU]) > 0.0
            if lands:
                if low > 0.0 and forward:
                    return solved, hint, True
            elif x0 + 0.5 * h * total_of(weights, v[FX]) <= 1.0 and (low >= 0.0 or not forward):
                return h, 2.0 * h if sweeps <= 16 else h, False
        h *= 0.5
        lands, hint = False, h
    return 0.0, hint, False


@part
def end_of_step(
    table: Floats, half: float, run: Floats, pieces: Floats, x0: float, u0: float, h: float,
    running: Floats, weights: Floats, tail: Floats, v: Floats,
) -> tuple[float, float]:  # fmt: skip
    """Solve a step of the length ``h``: the position and u at its end."""
    collocate(table, half, run, pieces, x0, u0, h, False, running, weights, tail, v)
    return x0 + 0.5 * h * total_of(weights, v[FX]), u0 + 0.5 * h * total_of(weights, v[FU])


@part
def add_up(h: float, u1: float, v: Floats, weights: Floats, places: Floats, to_series: Floats, scratch: Floats,
           totals: Floats) -> None:  # fmt: skip
    """Add a step to the totals."""
    half = 0.5 * h
    totals[WORK_DRIVE] += half * total_of(weights, v[POWER_D])
    totals[WORK_RESISTANCE] += half * total_of(weights, v[POWER_R])
    totals[WORK_SLIP] += half * total_of(weights, v[POWER_S])
    totals[SPEED_MAX] = peak(v[OMEGA], totals[SPEED_MAX], places, to_series, scratch)
    totals[TORQUE_MAX] = peak(v[TORQUE], totals[TORQUE_MAX], places, to_series, scratch)
    totals[POWER_MAX] = peak(v[POWER_D], totals[POWER_MAX], places, to_series, scratch)
    for j in range(len(weights)):
        v[SPARE, j] = -v[OMEGA, j]
    totals[SPEED_MIN] = 0.0 if u1 == 0.0 else -peak(v[SPARE], -totals[SPEED_MIN], places, to_series, scratch)
    totals[STEPS] += 1.0


@part
def sample(
    cut: float, half: float, h: float, x0: float, u0: float, clock: float, times: Floats, first: int,
    to_integral: Floats, v: Floats, scratch: Floats, out: Floats,
) -> int:  # fmt: skip
    """Write angle and u at those ``times`` that lie within a step, and return the number of the next one."""
    while first < len(times) and times[first] <= clock + h:
        s = min(max(2.0 * (times[first] - clock) / h - 1.0, -1.0), 1.0)
        x = min(max(x0 + integral_to(v[FX], h, s, to_integral, scratch), -1.0), 1.0)
        out[first, 0] = cut + half * (1.0 + x)
        out[first, 1] = max(u0 + integral_to(v[FU], h, s, to_integral, scratch), 0.0)  # 0 but for rounding
        first += 1
    return first


@compiled
def follow(
    cuts: Floats, tables: Floats, run: Floats, pieces: Floats, state: Floats, times: Floats, out: Floats,
    totals: Floats, running: Floats, weights: Floats, tail: Floats, to_series: Floats, to_integral: Floats,
    places: Floats,
) -> int:  # fmt: skip
    """Integrate from ``state`` until the target is reached, the shaft stops, or the farthest angle is passed.

    Parameters
    ----------
    cuts : array, shape (panels + 1,)
        Ends of the panels in rad.
    tables : array, shape (panels, rows, terms)
        Chebyshev series of the inertia, the drive's torque besides that of a motor, the energy of the target, and the
        resisting torque.
    run, state : arrays
        Numbers of the run, and where it begins.
    pieces : array, shape (m, 6)
        The motor's table.
    times, out : arrays, shapes (m,) and (m, 2)
        Ascending times, and the angle and u there, written up to the end.
    totals : array, written
    running, weights, tail, to_series, to_integral, places : arrays
        Of the panels' nodes.
    """
    panels = len(tables)
    v, scratch = np.empty((ROWS, len(weights))), np.empty(len(weights) + 2)
    p, x, u, clock, turned = int(state[PANEL]), state[PLACE], state[ROOT], state[CLOCK], state[CYCLES]
    cycle, hint, next_time, status = cuts[panels], np.inf, 0, EXHAUSTED
    sided = run[SIDE] != 0.0
    if sided and off_target(tables[p], run, x, u) <= 0.0:
        status = REACHED
    while status == EXHAUSTED and totals[STEPS] < _MOST_STEPS:
        table, half = tables[p], 0.5 * (cuts[p + 1] - cuts[p])
        if turned + cuts[p] + half * (1.0 + x) >= run[FARTHEST]:
            status = TURNED
            break
        h, lands = ahead(table, half, run, pieces, x, u, hint, v)
        if h == 0.0:
            status = NOT_STARTED if totals[STEPS] == 0.0 else STOPPED
            break
        h, hint, lands = solve_step(table, half, run, pieces, x, u, h, lands, hint, running, weights, tail, v)
        if h == 0.0:
            break
        x1 = x + 0.5 * h * total_of(weights, v[FX])
        u1 = u + 0.5 * h * total_of(weights, v[FU])
        stops = u1 <= 0.0
        if stops or (sided and off_target(table, run, 1.0 if lands else x1, u1) <= 0.0):
            status = STOPPED if stops else REACHED
            h = event_time(table, run, h, x, u, stops, to_integral, v, scratch)
            x1, u1 = end_of_step(table, half, run, pieces, x, u, h, running, weights, tail, v)
            lands, u1 = False, 0.0 if stops else u1
        add_up(h, u1, v, weights, places, to_series, scratch, totals)
        next_time = sample(turned + cuts[p], half, h, x, u, clock, times, next_time, to_integral, v, scratch, out)
        clock, u, x = clock + h, u1, x1
        if lands:
            p, x = p + 1, -1.0
            if p == panels:
                p, turned = 0, turned + cycle
        # The load is not known beyond the speeds of its rows.
        if status == EXHAUSTED and tables.shape[1] > RESISTANCE + 1 and totals[SPEED_MAX] > run[FASTEST]:
            status = TURNED
    totals[TIME], totals[ENERGY] = clock, 0.5 * u * u
    totals[ANGLE] = turned + cuts[p] + 0.5 * (cuts[p + 1] - cuts[p]) * (1.0 + x)
    out[next_time:, 0], out[next_time:, 1] = totals[ANGLE], u
    return status
