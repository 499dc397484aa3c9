"""The equations of motion (docs/theory.md) as recurrences of Taylor coefficients, written once for every kernel.

Notation of one order k: ``phi, w, u, T`` are angle, speed, windup and clutch torque of a pendulum, ``W_`` and ``S``
speed and total clutch torque of the shaft, ``X, Y`` the base's accelerations x'' and y''. Equation (1) is used divided
by J:

    w' = (M l/J) (x'' cos phi + y'' sin phi + g sin phi) - (c a^2/J) phi - (lambda/J) w - T/J
    shaft' = (sum T - M_c - (lambda_e + k_1) shaft - k_2 shaft^2 - B) / J_e
    B = M_s exp(-shaft/omega_s) + kappa M_c cos theta + level + slope shaft,   theta' = m shaft
    T = sum c_k u^(k-1) + rate u'                  u' = w - shaft

Modes enter as numbers, not branches: the law in force is zero where a clutch is free and a straight line beyond the
data, and the rate in force is the damping of an engaged or of an overrunning clutch; the shaft's mobility is zero where
it is held. A locked clutch has w' = shaft', and its torque follows from this.
"""

import math

from sprag_study.engine.taylor.straight import (
    ROUND,
    LaneCode,
    Term,
    exp2,
    exponential,
    horner,
    larger,
    log2,
    product,
    same_everywhere,
    sincos,
    smaller,
    square,
)
from sprag_study.engine.vibration_drive.formulas import (
    base_series,
    drive,
    free_acceleration,
    harmonic_series,
    ramped_series,
    resistance,
)
from sprag_study.engine.vibration_drive.layout import Layout

#: Share of the estimated convergence-limited step that is taken (Jorba and Zou 2005 take e^-2, which is far too careful
#: here). With 0.75 there would be a tenth fewer steps, but three to five times the errors (benchmarks.engine).
STEP_SAFETY = 0.66
#: Longest step, in excitation periods. Where nothing moves, the torque of a locked clutch follows the excitation all
#: the same: there its series' first neglected term keeps the step shorter.
LONGEST_STEP = 0.25
#: Share of the base's largest drive that counts as motion in any case when a step's error is weighed.
DRIVE_SHARE = 1e-3
#: Rows that a load with a factor that changes reads.
RAMPED_LOAD = ("load_factor", "generator", "quadratic", "load_slope")
#: Speed of the shaft over that of a load that falls with it, from which on the load is nothing: e^-60 of that at rest.
NOTHING = 60.0


class _Pendulum:
    """Local names of one pendulum's parameters and series."""

    def __init__(self, code: LaneCode, layout: Layout, index: int) -> None:
        self.index = index
        self.base = layout.pendulums + index * layout.stride
        for name in ("ml", "spring", "damping", "inverse_inertia", "inertia", "locked"):
            setattr(self, name, code.load(f"{name}{index}", self.row(layout, name)))
        if layout.drag:
            self.rate = code.load(f"rate{index}", self.row(layout, "rate"))
        first = self.row(layout, "force")
        self.force = [code.load(f"e{index}_{k}", first + k) for k in range(layout.coefficients)]
        self.phi = [code.load(f"phi{index}_0", self.row(layout, "phi"))]
        self.w = [code.load(f"w{index}_0", self.row(layout, "speed"))]
        self.u = [code.load(f"u{index}_0", self.row(layout, "u"))]
        s, c = sincos(code, self.phi[0], f"{index}")
        self.sin, self.cos = [s], [c]
        self.torque: list[Term] = []
        self.drive: list[Term] = []
        self.squared: list[Term] = []  # u^2
        self.levels: list[list[Term]] = [[] for _ in range((layout.coefficients - 1) // 2)]
        self.free = ""

    ml: Term
    weight: Term
    spring: Term
    damping: Term
    inverse_inertia: Term
    inertia: Term
    locked: Term
    rate: Term

    def row(self, layout: Layout, name: str) -> int:
        offset: int = getattr(layout, f"p_{name}")
        return self.base + offset


def _excitation(code: LaneCode, layout: Layout) -> tuple[list[Term], list[Term]]:
    """Series of the base's accelerations (2), with those of its harmonics."""
    if layout.ramped:
        return _ramped_excitation(code, layout)
    names = ("f", "nu", "acc_x", "acc_y", "cos_chi", "sin_chi")
    f, nu, acc_x, acc_y, cos_chi, sin_chi = (code.load(name, getattr(layout, name)) for name in names)
    s, c = sincos(code, code.let("theta", f"6.283185307179586*{f}"), "t")
    first_x, first_y = base_series(acc_x, acc_y, nu, s, c, sin_chi, cos_chi)
    x = [code.let(f"X{k}", term) for k, term in enumerate(first_x)]
    y = [code.let(f"Y{k}", term) for k, term in enumerate(first_y)]
    code.let("nu2", f"{nu}*{nu}")
    for k in range(2, layout.order):
        factor = code.let(f"nu2_{k}", f"nu2*{-1.0 / (k * (k - 1))!r}")
        x.append(code.let(f"X{k}", f"{factor}*{x[k - 2]}"))
        y.append(code.let(f"Y{k}", f"{factor}*{y[k - 2]}"))
    for index in range(layout.harmonics):
        further_x, further_y = _harmonic(code, layout, index)
        x = [code.let(f"X{k}", x[k] + further_x[k]) for k in range(layout.order)]
        y = [code.let(f"Y{k}", y[k] + further_y[k]) for k in range(layout.order)]
    return x, y


def _harmonic(code: LaneCode, layout: Layout, index: int) -> tuple[list[Term], list[Term]]:
    """Series of the accelerations of the base in x and y by one of its harmonics."""
    order = code.load("m", layout.harmonic_order + index)
    factors = [
        code.load(f"m_{name}", getattr(layout, f"harmonic_{name}") + index)
        for name in ("x_cos", "x_sin", "y_cos", "y_sin")
    ]
    turns = code.let("m_turns", f"{order}*f")
    part = code.let("m_part", f"{turns} - (({turns} + {ROUND}) - {ROUND})")
    s, c = sincos(code, code.let("m_theta", f"6.283185307179586*{part}"), "m")
    rate = code.let("m_rate", f"{order}*nu")
    x_cos, x_sin, y_cos, y_sin = factors
    first_x, first_y = harmonic_series(x_cos, x_sin, y_cos, y_sin, rate, s, c)
    x = [code.let(f"MX{k}", term) for k, term in enumerate(first_x)]
    y = [code.let(f"MY{k}", term) for k, term in enumerate(first_y)]
    square_rate = code.let("m_rate2", f"{rate}*{rate}")
    for k in range(2, layout.order):
        factor = code.let("m_factor", f"{square_rate}*{-1.0 / (k * (k - 1))!r}")
        x.append(code.let(f"MX{k}", f"{factor}*{x[k - 2]}"))
        y.append(code.let(f"MY{k}", f"{factor}*{y[k - 2]}"))
    return x, y


def _ramped_excitation(code: LaneCode, layout: Layout) -> tuple[list[Term], list[Term]]:
    """Series of the accelerations of a base whose frequency changes, with those of its harmonics."""
    code.load("f", layout.f)
    turns, rate, slope = (code.load(name, getattr(layout, name)) for name in ("phase", "phase_rate", "phase_slope"))
    nu, cos_chi, sin_chi = (code.load(name, getattr(layout, name)) for name in ("nu", "cos_chi", "sin_chi"))
    per = code.let("per", f"1.0/({nu}*{nu})")
    b = code.let("b", f"{code.row(layout.acc_y)}*{per}")
    factors: tuple[Term, ...] = (
        code.let("d", f"{code.row(layout.acc_x)}*{per}"),
        Term("0.0"),
        b * sin_chi,
        b * cos_chi,
    )
    x, y = _ramped_part(code, layout.order, factors, turns, (rate, slope))
    for index in range(layout.harmonics):
        order = code.load("m", layout.harmonic_order + index)
        square = code.let("m_square", f"{order}*{order}")
        scale = code.let("m_per", f"-{per}/({larger(square, '1.0')})")  # of no harmonic the order is 0
        rows = (getattr(layout, f"harmonic_{name}") + index for name in ("x_cos", "x_sin", "y_cos", "y_sin"))
        factors = tuple(code.let("m_factor", f"{code.row(row)}*{scale}") for row in rows)
        motion = code.let("m_rate", f"{order}*{rate}"), code.let("m_slope", f"{order}*{slope}")
        further = _ramped_part(code, layout.order, factors, code.let("m_turns", f"{order}*{turns}"), motion)
        x, y = (
            [code.let("base", f"{one} + {other}") for one, other in zip(*pair, strict=True)]
            for pair in ((x, further[0]), (y, further[1]))
        )
    return x, y


def _ramped_part(
    code: LaneCode, order: int, factors: tuple[Term, ...], turns: Term, motion: tuple[Term, Term]
) -> tuple[list[Term], list[Term]]:
    """Series of the accelerations in x and y of one part of the motion of the base, as `formulas.ramped_series`.

    Sine and cosine of theta, which is at ``turns`` now, have (sin)' = theta' cos and (cos)' = -theta' sin; the
    acceleration is the second derivative of the displacement, whose coefficients they give.
    """
    rate, slope = motion
    part = code.let("part", f"{turns} - (({turns} + {ROUND}) - {ROUND})")
    sin, cos = ([term] for term in sincos(code, code.let("theta", f"6.283185307179586*{part}"), "t"))
    x_cos, x_sin, y_cos, y_sin = (code.let("factor", factor) for factor in factors)
    first_x, first_y = ramped_series(x_cos, x_sin, y_cos, y_sin, motion, sin[0], cos[0])
    x = [code.let("X", term) for term in first_x]
    y = [code.let("Y", term) for term in first_y]
    for k in range(1, order + 2):
        turned = [f"({rate}*{other[k - 1]}" + (f" + {slope}*{other[k - 2]})" if k > 1 else ")") for other in (cos, sin)]
        sin.append(code.let("sine", f"{turned[0]}*{1.0 / k!r}"))
        cos.append(code.let("cosine", f"{turned[1]}*{-1.0 / k!r}"))
        if k > 3:
            x.append(code.let("X", f"({x_cos}*{cos[k]} + {x_sin}*{sin[k]})*{float(k * (k - 1))!r}"))
            y.append(code.let("Y", f"({y_cos}*{cos[k]} + {y_sin}*{sin[k]})*{float(k * (k - 1))!r}"))
    return x, y


def _torque(code: LaneCode, p: _Pendulum, k: int, damping: str) -> Term:
    """Coefficient k of the clutch torque (3) by Horner's scheme in u^2: c_1 + c_2 u + u^2 (c_3 + c_4 u + ...).

    ``damping`` is what is added to it.
    """
    top, *lower = [p.force[j : j + 2] for j in reversed(range(0, len(p.force), 2))]
    value = _straight(top, p.u, k)
    if lower:
        p.squared.append(code.let(f"q{p.index}_{k}", square(p.u, k)))
    for level, pair in enumerate(lower):
        if level == 0 and len(top) == 1:
            higher = f"{top[0]}*{p.squared[k]}"
        else:
            p.levels[level].append(code.let(f"h{p.index}_{level}_{k}", value))
            higher = product(p.levels[level], p.squared, k)
        value = f"{_straight(pair, p.u, k)} + {higher}"
    return code.let(f"T{p.index}_{k}", f"{value}{damping}")


def _straight(pair: list[Term], u: list[Term], k: int) -> str:
    """Coefficient k of ``c + d u`` for the numbers c and, where there is one, d."""
    terms = [pair[0]] if k == 0 else []
    return " + ".join([*terms, *(f"{d}*{u[k]}" for d in pair[1:])]) or "0.0"


def _free_acceleration(code: LaneCode, p: _Pendulum, x: list[Term], y: list[Term], k: int) -> None:
    """Coefficient k of a pendulum's acceleration without its clutch, and of the base's drive."""
    i = p.index
    if k > 0:
        p.sin.append(_turned(code, f"s{i}_{k}", p.cos, p, k, 1.0))
        p.cos.append(_turned(code, f"c{i}_{k}", p.sin, p, k, -1.0))
    p.drive.append(code.let(f"D{i}_{k}", drive(x, y, p.sin, p.cos, k)))
    free = free_acceleration(p.ml, p.weight, p.spring, p.damping, p.phi[k], p.w[k], p.sin[k], p.drive[k])
    p.free = code.let(f"F{i}_{k}", free)


def _turned(code: LaneCode, name: str, other: list[Term], p: _Pendulum, k: int, sign: float) -> Term:
    """Coefficient k of the angle's sine from its cosine or, with ``sign`` -1, of its cosine from its sine.

    It is the integral of ``other`` times the speed; the term with the newest coefficient comes last.
    """
    newest = f"{other[0]}*{p.phi[k]}" if sign > 0.0 else f"({other[0]})*(-{p.phi[k]})"
    older = " + ".join(f"{other[j]}*{p.w[k - 1 - j]}" for j in range(1, k))
    return code.let(name, f"({older})*{sign / k!r} + {newest}" if older else newest)


def series_loop(layout: Layout) -> str:
    """Source of the loop that finds the series of every lane, in fractions of the step they allow, and stores them."""
    code = LaneCode(layout.lanes)
    order = layout.order
    names = (
        *("gravity", "load", "mobility"),
        *(("linear", "quadratic") if layout.drag else ()),
    )
    gravity, *_ = (code.load(name, getattr(layout, name)) for name in names)
    x, y = _excitation(code, layout)
    pendulums = [_Pendulum(code, layout, i) for i in range(layout.n)]
    for p in pendulums:
        p.weight = code.let(f"weight{p.index}", p.ml * gravity)
    shaft = [code.load("W0", layout.speed)]
    rates: list[Term] = []
    bent = _Curve(code, layout, shaft, rates) if layout.curved else None
    curve = [] if bent is None else bent.series
    for k in range(order + 1):
        if bent is not None:
            bent.extend(k)
        for p in pendulums:
            damping = f" + {p.rate}*({p.w[k]} - {shaft[k]})" if layout.drag else ""
            p.torque.append(_torque(code, p, k, damping))
        if k < order:
            for p in pendulums:
                _free_acceleration(code, p, x, y, k)
            push = " + ".join(f"({p.torque[k]} + {p.locked}*{p.inertia}*{p.free})" for p in pendulums)
            against = " - load" if k == 0 else ""
            if layout.drag:
                squared = code.let(f"WW{k}", square(shaft, k))
                against += f" - {resistance(Term('linear'), Term('quadratic'), shaft[k], squared)}"
            if layout.curved:
                against += f" - {curve[k]}"
            rates.append(code.let(f"A{k}", f"mobility*({push}{against})"))
            shaft.append(code.let(f"W{k + 1}", f"A{k}*{1.0 / (k + 1)!r}"))
            for p in pendulums:
                i = p.index
                code.let(f"a{i}_{k}", f"A{k} if {p.locked} > 0.5 else {p.free} - {p.inverse_inertia}*{p.torque[k]}")
                p.torque[k] = code.let(
                    f"L{i}_{k}", f"{p.inertia}*({p.free} - A{k}) if {p.locked} > 0.5 else {p.torque[k]}"
                )
                p.w.append(code.let(f"w{i}_{k + 1}", f"a{i}_{k}*{1.0 / (k + 1)!r}"))
                p.phi.append(code.let(f"phi{i}_{k + 1}", f"{p.w[k]}*{1.0 / (k + 1)!r}"))
                p.u.append(code.let(f"u{i}_{k + 1}", f"({p.w[k]} - {shaft[k]})*{1.0 / (k + 1)!r}"))
    _step_size(code, layout, pendulums, shaft, bent)
    _in_fractions(code, order, pendulums, shaft, curve)
    _store_series(code, layout, pendulums, shaft)
    for k, term in enumerate(curve):
        code.store(layout.curve + k, term)
    return code.loop()


class _Curve:
    """Series of B, the terms of the load that are no polynomial of the speed.

    Of a table, the line level + slope shaft on which the speed is belongs to it: its corners are events. Of a load with
    a factor s that changes linearly in time, s - 1 times the whole load belongs to it.
    y = M_s exp(-shaft/omega_s) has y' = -(shaft'/omega_s) y, and sine and cosine of theta have (sin)' = m shaft cos.
    """

    def __init__(self, code: LaneCode, layout: Layout, shaft: list[Term], rates: list[Term]) -> None:
        self.code, self.shaft, self.rates = code, shaft, rates
        self.falls, self.decay = code.load("stribeck", layout.stribeck), code.load("decay", layout.stribeck_rate)
        self.cyclic, self.cycles = code.load("cyclic", layout.cyclic), code.load("cycles", layout.cycles)
        sine, cosine = sincos(code, code.load("cycle", layout.cycle), "e")
        self.sine, self.cosine = [sine], [cosine]
        self.line = [code.load(name, getattr(layout, name)) for name in ("level", "slope")] if layout.tabled else []
        self.factor = [code.load(name, getattr(layout, name)) for name in RAMPED_LOAD] if layout.ramped else []
        self.falling: list[Term] = []
        self.whole: list[Term] = []
        self.series: list[Term] = []

    def extend(self, k: int) -> None:
        """Add coefficient k, from those of the speed up to k and of its rate before k."""
        code = self.code
        if k == 0:
            value = f"{self.falls}*{exponential(code, f'-{self.decay}*{self.shaft[0]}', 'E')}"
        else:
            value = f"({product(self.rates, self.falling, k - 1)})*({self.decay}*{-1.0 / k!r})"
            turned = code.let(f"m{k}", f"{self.cycles}*{1.0 / k!r}")
            sine = code.let(f"es{k}", f"({product(self.shaft, self.cosine, k - 1)})*{turned}")
            cosine = code.let(f"ec{k}", f"({product(self.shaft, self.sine, k - 1)})*(-{turned})")
            self.sine.append(sine)
            self.cosine.append(cosine)
        self.falling.append(code.let(f"E{k}", value))
        value = f"{self.falling[k]} + {self.cyclic}*{self.cosine[k]}"
        if self.line:
            level, slope = self.line
            value += f" + {slope}*{self.shaft[k]}" + (f" + {level}" if k == 0 else "")
        if self.factor:
            value = self._ramped(value, k)
        self.series.append(code.let(f"B{k}", value))

    def _ramped(self, value: str, k: int) -> str:
        """Coefficient k of B where the load has a factor, from that without one."""
        code = self.code
        factor, generator, quadratic, change = self.factor
        against = resistance(generator, quadratic, self.shaft[k], code.let("V", square(self.shaft, k)))
        polynomial = code.let("polynomial", against + (Term("load") if k == 0 else Term("0.0")))
        self.whole.append(code.let("whole", f"{value} + {polynomial}"))
        value = f"{factor}*{self.whole[k]} - {polynomial}"
        return value if k == 0 else f"{value} + {change}*{self.whole[k - 1]}"


def _watched(code: LaneCode, step: Term, bent: _Curve, shaft: list[Term], order: int) -> str:
    """The part of a step in which the last coefficients of a load that falls with the speed show what it misses.

    Far above omega_s the load is nothing, and so are its coefficients, whatever it is at the end of the step. Its
    exponent changes by as much as the order at most, where the last of its terms is a tenth of all that are left out,
    or remains where the load is nothing.
    """
    decay = code.let("falls_at", f"{bent.decay} if {bent.falls} > 0.0 else 0.0")
    rates = [code.let("size", f"abs({term})") for term in shaft[1:]]
    change = code.let("change", f"{decay}*{step}*({horner(rates, step)})")
    most = code.let("most_change", larger(repr(float(order)), f"{decay}*{shaft[0]} - {NOTHING!r}"))
    return f"{step}*{most}/({change} + 1e-300) if {change} > {most} else {step}"


def _in_fractions(code: LaneCode, order: int, pendulums: list[_Pendulum], shaft: list[Term], curve: list[Term]) -> None:
    """Rescale every series from seconds to fractions of the step: coefficient k times h^k."""
    power = "h"
    for k in range(1, order + 1):
        if k > 1:
            power = code.let(f"h_{k}", f"{power}*h")
        shaft[k] = code.let(f"Wx{k}", f"{shaft[k]}*{power}")
        if curve:
            curve[k] = code.let(f"Bx{k}", f"{curve[k]}*{power}")
        for p in pendulums:
            i = p.index
            p.w[k] = code.let(f"wx{i}_{k}", f"{p.w[k]}*{power}")
            p.torque[k] = code.let(f"Tx{i}_{k}", f"{p.torque[k]}*{power}")
            if k < order:
                p.drive[k] = code.let(f"Dx{i}_{k}", f"{p.drive[k]}*{power}")


def _store_series(code: LaneCode, layout: Layout, pendulums: list[_Pendulum], shaft: list[Term]) -> None:
    for k in range(layout.order + 1):
        if k > 0:
            code.store(layout.speed + k, shaft[k])
        for p in pendulums:
            if k > 0:
                code.store(p.row(layout, "speed") + k, p.w[k])
            code.store(p.row(layout, "torque") + k, p.torque[k])
            if k < layout.order:
                code.store(p.row(layout, "drive") + k, p.drive[k])


def _step_size(
    code: LaneCode, layout: Layout, pendulums: list[_Pendulum], shaft: list[Term], bent: _Curve | None
) -> None:
    """Step from the last two coefficients of every speed, relative to the size of that speed's motion."""
    order = layout.order
    code.load("inverse_rate", layout.inverse_rate)
    largest = (layout.vibration_x, layout.vibration_y) if layout.harmonics else (layout.acc_x, layout.acc_y)
    series = []
    for p in pendulums:
        # The share of the base's drive is for the instant at which a locked pendulum starts from rest without
        # acceleration.
        least = f"abs({p.ml})*{DRIVE_SHARE}*({code.row(largest[0])} + {code.row(largest[1])})"
        scale = code.let(
            f"scale{p.index}",
            f"abs({p.w[0]}) + inverse_rate*(abs({p.w[1]}) + {least} + inverse_rate*abs({p.w[2]})) + 1e-300",
        )
        series.append((p.w, scale, code.let(f"unit{p.index}", f"1.0/{scale}")))
    whole = code.let("scale_shaft", " + ".join(scale for _, scale, _ in series) + f" + abs({shaft[0]})")
    series.append((shaft, whole, code.let("unit_shaft", f"1.0/{whole}")))
    for last in (order, order - 1):
        worst = code.let(f"r{last}", "0.0")
        for number, (names, _, unit) in enumerate(series):
            ratio = code.let(f"r{last}_{number}", f"abs({names[last]})*{unit}")
            worst = code.let(f"r{last}", f"{ratio} if {ratio} > {worst} else {worst}")
        code.let(f"x{last}", f"(log2_tolerance - {log2(worst)})*{1.0 / last!r}")
    exponent = code.let("x", smaller(f"x{order}", f"x{order - 1}"))
    code.let("h_free", f"{STEP_SAFETY}*({exp2(exponent)})")
    code.load("period", layout.period)
    rest = code.let("rest", f"({code.row(layout.f_stop)} - f)*period")
    neglected = same_everywhere(math.log2(math.factorial(order + 1)))
    followed = exp2(f"(log2_tolerance + {neglected!r})*{1.0 / (order + 1)!r}")
    code.let("followed", f"{0.5 / math.pi!r}*({followed})")
    longest = code.let("longest", f"({smaller('followed', repr(LONGEST_STEP))})*period")
    if layout.harmonics:
        longest = code.let("longest", f"{longest}/{code.row(layout.highest_order)}")
    code.store(layout.h_free, "h_free")
    wanted = smaller("h_free", longest)
    code.let("h_wanted", wanted if bent is None else _watched(code, code.let("h_smooth", wanted), bent, shaft, order))
    # A stop barely after the step's end is included in the step instead of leaving a step of rounding size.
    code.store(layout.at_stop, f"0.0 if h_wanted < {rest}*0.999999 else 1.0")
    code.let("h", f"h_wanted if h_wanted < {rest}*0.999999 else {rest}")
    code.store(layout.h, "h")
    code.store(layout.x, "1.0")
    for p in pendulums:
        code.store(p.row(layout, "allowed"), f"tolerance*scale{p.index}*{p.inertia}/h")
