"""The equations of motion (MODEL.md A1) as recurrences of Taylor coefficients, written once for every kernel.

Notation of one order k: ``phi, w, u, T`` are angle, speed, windup and clutch torque of a pendulum, ``W_`` and ``S``
speed and total clutch torque of the shaft, ``X, Y`` the base's accelerations x'' and y''. Equation (1) is used divided
by J:

    w' = (M l/J) (x'' cos phi + y'' sin phi + g sin phi) - (c a^2/J) phi - (lambda/J) w - T/J
    shaft' = (sum T - M_c) / J_e                  T = sum c_k u^(k-1)                 u' = w - shaft

Modes enter as numbers, not branches: the law in force is zero where a clutch is free and a straight line beyond the
data; the shaft's mobility is zero where it is held. A locked clutch has w' = shaft' and its torque is what that takes.
"""

from engine.taylor.straight import (
    LaneCode,
    exp2,
    log2,
    product,
    sincos,
    smaller,
)
from engine.vibration_drive.layout import Layout

#: Share of the estimated convergence-limited step that is taken (Jorba and Zou 2005 take e^-2, which is far too careful
#: here).
STEP_SAFETY = 0.62
#: Longest step, in excitation periods.
LONGEST_STEP = 0.25
#: Share of the base's largest drive that counts as motion in any case when a step's error is weighed.
DRIVE_SHARE = 1e-3


class _Pendulum:
    """Local names of one pendulum's parameters and series."""

    def __init__(self, code: LaneCode, layout: Layout, index: int) -> None:
        self.index = index
        self.base = layout.pendulums + index * layout.stride
        for name in ("ml", "spring", "damping", "inverse_inertia", "inertia", "locked"):
            setattr(self, name, code.load(f"{name}{index}", self.row(layout, name)))
        first = self.row(layout, "force")
        self.force = [code.load(f"e{index}_{k}", first + k) for k in range(layout.coefficients)]
        self.phi = [code.load(f"phi{index}_0", self.row(layout, "phi"))]
        self.w = [code.load(f"w{index}_0", self.row(layout, "speed"))]
        self.u = [code.load(f"u{index}_0", self.row(layout, "u"))]
        s, c = sincos(code, self.phi[0], f"{index}")
        self.sin, self.cos = [s], [c]
        self.torque: list[str] = []
        self.drive: list[str] = []
        self.powers: list[list[str]] = [[] for _ in range(layout.coefficients - 2)]
        self.free = ""

    ml: str
    spring: str
    damping: str
    inverse_inertia: str
    inertia: str
    locked: str

    def row(self, layout: Layout, name: str) -> int:
        offset: int = getattr(layout, f"p_{name}")
        return self.base + offset


def _excitation(code: LaneCode, layout: Layout) -> tuple[list[str], list[str]]:
    """Series of the base's accelerations (2): x'' = -d nu^2 cos(nu t), y'' = -b nu^2 sin(nu t + chi)."""
    names = ("f", "nu", "acc_x", "acc_y", "cos_chi", "sin_chi")
    f, nu, acc_x, acc_y, cos_chi, sin_chi = (code.load(name, getattr(layout, name)) for name in names)
    s, c = sincos(code, code.let("theta", f"6.283185307179586*{f}"), "t")
    x = [code.let("X0", f"-{acc_x}*{c}"), code.let("X1", f"{acc_x}*{nu}*{s}")]
    y = [
        code.let("Y0", f"-{acc_y}*({s}*{cos_chi} + {c}*{sin_chi})"),
        code.let("Y1", f"-{acc_y}*{nu}*({c}*{cos_chi} - {s}*{sin_chi})"),
    ]
    code.let("nu2", f"{nu}*{nu}")
    for k in range(2, layout.order):
        factor = code.let(f"nu2_{k}", f"nu2*{-1.0 / (k * (k - 1))!r}")
        x.append(code.let(f"X{k}", f"{factor}*{x[k - 2]}"))
        y.append(code.let(f"Y{k}", f"{factor}*{y[k - 2]}"))
    return x, y


def _torque(code: LaneCode, p: _Pendulum, k: int) -> str:
    """Coefficient k of the clutch torque (3), by Horner's scheme on series."""
    inner = p.force[-1]  # the highest coefficient; a number, not yet a series
    value = f"{inner}*{p.u[k]}"
    for level, coefficient in enumerate(reversed(p.force[:-1])):
        if k == 0:
            value = f"{coefficient} + {value}"
        if level < len(p.powers):
            p.powers[level].append(code.let(f"h{p.index}_{level}_{k}", value))
            value = product(p.powers[level], p.u, k)
    return code.let(f"T{p.index}_{k}", value)


def _free_acceleration(code: LaneCode, p: _Pendulum, x: list[str], y: list[str], k: int) -> None:
    """Coefficient k of a pendulum's acceleration without its clutch, and of the base's drive x'' cos phi + y'' sin
    phi.
    """
    if k > 0:
        p.sin.append(code.let(f"s{p.index}_{k}", f"({product(p.cos, p.w, k - 1)})*{1.0 / k!r}"))
        p.cos.append(code.let(f"c{p.index}_{k}", f"({product(p.sin, p.w, k - 1)})*{-1.0 / k!r}"))
    p.drive.append(code.let(f"D{p.index}_{k}", f"{product(x, p.cos, k)} + {product(y, p.sin, k)}"))
    p.free = code.let(
        f"F{p.index}_{k}",
        f"{p.ml}*({p.drive[k]} + gravity*{p.sin[k]}) - {p.spring}*{p.phi[k]} - {p.damping}*{p.w[k]}",
    )


def series_loop(layout: Layout) -> str:
    """Source of the loop that finds the series of every lane, in fractions of the step they allow, and stores them."""
    code = LaneCode(layout.lanes)
    order = layout.order
    for name in ("gravity", "load", "mobility"):
        code.load(name, getattr(layout, name))
    x, y = _excitation(code, layout)
    pendulums = [_Pendulum(code, layout, i) for i in range(layout.n)]
    shaft = [code.load("W0", layout.speed)]
    total: list[str] = []
    for k in range(order + 1):
        for p in pendulums:
            p.torque.append(_torque(code, p, k))
        if k < order:
            for p in pendulums:
                _free_acceleration(code, p, x, y, k)
            push = " + ".join(f"({p.torque[k]} + {p.locked}*{p.inertia}*{p.free})" for p in pendulums)
            code.let(f"A{k}", f"mobility*({push}{' - load' if k == 0 else ''})")
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
        total.append(code.let(f"S{k}", " + ".join(p.torque[k] for p in pendulums)))
    _step_size(code, layout, pendulums, shaft)
    _in_fractions(code, order, pendulums, shaft, total)
    power = [code.let(f"P{k}", product(total, shaft, k)) for k in range(order + 1)]
    _store_series(code, layout, pendulums, shaft, total, power)
    return code.loop()


def _in_fractions(code: LaneCode, order: int, pendulums: list[_Pendulum], shaft: list[str], total: list[str]) -> None:
    """Rescale every series from seconds to fractions of the step: coefficient k times h^k."""
    power = "h"
    for k in range(1, order + 1):
        if k > 1:
            power = code.let(f"h_{k}", f"{power}*h")
        shaft[k] = code.let(f"Wx{k}", f"{shaft[k]}*{power}")
        for p in pendulums:
            i = p.index
            p.w[k] = code.let(f"wx{i}_{k}", f"{p.w[k]}*{power}")
            p.torque[k] = code.let(f"Tx{i}_{k}", f"{p.torque[k]}*{power}")
            if k < order:
                p.drive[k] = code.let(f"Dx{i}_{k}", f"{p.drive[k]}*{power}")
        total[k] = code.let(f"Sx{k}", " + ".join(p.torque[k] for p in pendulums))


def _store_series(
    code: LaneCode, layout: Layout, pendulums: list[_Pendulum], shaft: list[str], total: list[str], power: list[str]
) -> None:
    for k in range(layout.order + 1):
        if k > 0:
            code.store(layout.speed + k, shaft[k])
        code.store(layout.sum + k, total[k])
        code.store(layout.power + k, power[k])
        for p in pendulums:
            if k > 0:
                code.store(p.row(layout, "speed") + k, p.w[k])
            code.store(p.row(layout, "torque") + k, p.torque[k])
            if k < layout.order:
                code.store(p.row(layout, "drive") + k, p.drive[k])


def _step_size(code: LaneCode, layout: Layout, pendulums: list[_Pendulum], shaft: list[str]) -> None:
    """Step from the last two coefficients of every speed, relative to the size of that speed's motion."""
    order = layout.order
    code.load("inverse_rate", layout.inverse_rate)
    series = []
    for p in pendulums:
        # The share of the base's drive is for the instant at which a locked pendulum starts from rest without
        # acceleration.
        drive = f"abs({p.ml})*{DRIVE_SHARE}*({code.row(layout.acc_x)} + {code.row(layout.acc_y)})"
        scale = code.let(
            f"scale{p.index}",
            f"abs({p.w[0]}) + inverse_rate*(abs({p.w[1]}) + {drive} + inverse_rate*abs({p.w[2]})) + 1e-300",
        )
        series.append((p.w, scale))
    code.let("scale_shaft", " + ".join(scale for _, scale in series) + f" + abs({shaft[0]})")
    series.append((shaft, "scale_shaft"))
    for last in (order, order - 1):
        worst = code.let(f"r{last}", "0.0")
        for number, (names, scale) in enumerate(series):
            ratio = code.let(f"r{last}_{number}", f"abs({names[last]})/{scale}")
            worst = code.let(f"r{last}", f"{ratio} if {ratio} > {worst} else {worst}")
        code.let(f"x{last}", f"(log2_tolerance - {log2(worst)})*{1.0 / last!r}")
    exponent = code.let("x", smaller(f"x{order}", f"x{order - 1}"))
    code.let("h_free", f"{STEP_SAFETY}*({exp2(exponent)})")
    code.load("period", layout.period)
    rest = code.let("rest", f"({code.row(layout.f_stop)} - f)*period")
    longest = code.let("longest", f"{LONGEST_STEP}*period")
    code.store(layout.h_free, "h_free")
    code.let("h_wanted", smaller("h_free", longest))
    # A stop a hair behind the step's end is taken along rather than left for a step of rounding size.
    code.store(layout.at_stop, f"0.0 if h_wanted < {rest}*0.999999 else 1.0")
    code.let("h", f"h_wanted if h_wanted < {rest}*0.999999 else {rest}")
    code.store(layout.h, "h")
    code.store(layout.x, "1.0")
    for p in pendulums:
        code.store(p.row(layout, "allowed"), f"tolerance*scale{p.index}*{p.inertia}/h")
