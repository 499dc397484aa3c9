"""Bounds of watched quantities over a step: distances of guards to their bands, possible excess over extrema.

They are computed in the vector loop from the stored series; only lanes whose bounds cannot exclude an event or a new
extremum get a second look (``lanes.look_for_events``, ``window.collect_peaks``).
"""

from sprag_study.engine.taylor.straight import (
    LaneCode,
    Span,
    Term,
    horner,
    larger,
    primitive_span,
    rate_span,
    smaller,
    span,
)
from sprag_study.engine.vibration_drive.layout import Layout

#: Margin that indicates that the step itself is too long, not that a guard is close.
TOO_LONG = -1e308
#: Rounding share of a torque: for a constant torque no step reduces the defect below it.
_TORQUE_ROUNDING = 1e-14


class _Watch:
    """Code of the lane loop that finds every lane's ``margin`` and ``excess``."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self.code = code = LaneCode(layout.lanes, "_b")
        self.margin = code.let("margin", "1e300")
        self.excess = code.let("excess", "-1e300")
        self.h = code.load("h", layout.h)
        self.inverse_h = code.let("inverse_h", f"1.0/{self.h}")
        self.speed = code.series("W", layout.speed, layout.order + 1)
        self.torques: list[list[Term]] = []

    def guard(self, bounds: Span, block: int, low: int | None, high: int | None) -> None:
        """``low`` and ``high`` are rows of a band's edges; the distances to them go ``block`` rows further.

        After a crossing the quantity starts on an edge and leaves it immediately, which counts as far enough.
        """
        code = self.code
        if low is not None:
            edge = code.load("edge", low)
            gap = code.let("gap", f"{bounds.low} - {edge}")
            leaving = code.let("leaving", f"{bounds.slope} if {bounds.start} >= {edge} else -1e300")
            self._keep_off(low + block, gap, leaving, bounds)
        if high is not None:
            edge = code.load("edge", high)
            gap = code.let("gap", f"{edge} - ({bounds.high})")
            leaving = code.let("leaving", f"-{bounds.slope} if {bounds.start} <= {edge} else -1e300")
            self._keep_off(high + block, gap, leaving, bounds)

    def _keep_off(self, row: int, gap: str, leaving: str, bounds: Span) -> None:
        gap = self.code.let("gap", f"1e300 if {leaving} > {bounds.least_slope} else {gap}")
        self.code.store(row, gap)
        self.margin = self.code.let("margin", smaller(gap, self.margin))

    def peak(self, bounds: Span, block: int, high: int, low: int | None = None) -> None:
        """``high`` and ``low`` are rows of known extrema; their excess goes ``block`` rows further."""
        code = self.code
        bulge = code.let("bulge", f"0.0 if {bounds.monotone} else {bounds.bulge}")
        self._exceed(high + block, f"(({larger(bounds.start, bounds.end)}) + {bulge}) - {code.row(high)}")
        if low is not None:
            self._exceed(low + block, f"{code.row(low)} - (({smaller(bounds.start, bounds.end)}) - {bulge})")

    def _exceed(self, row: int, excess: str) -> None:
        excess = self.code.let("exceeding", excess)
        self.code.store(row, excess)
        self.excess = self.code.let("excess", larger(excess, self.excess))

    def pendulum(self, index: int) -> None:
        """Watch one pendulum and its clutch."""
        layout, code = self.layout, self.code
        count = layout.order + 1
        base = layout.pendulums + index * layout.stride

        def row(name: str) -> int:
            offset: int = getattr(layout, f"p_{name}")
            return base + offset

        block = layout.p_x_phi_max - layout.p_phi_max
        edges = layout.p_m_w_low - layout.p_w_low
        w = code.series("w", row("speed"), count)
        relative = [code.let(f"v{k}", f"{w[k]} - {self.speed[k]}") for k in range(count)]
        self.guard(span(code, "v", relative), edges, row("w_low"), row("w_high"))
        windup = primitive_span(code, "u", code.load("u", row("u")), relative[:-1], self.h)
        self.guard(windup, edges, row("u_low"), row("u_high"))
        self.peak(windup, block, row("u_max"))
        torque = code.series("T", row("torque"), count)
        self.torques.append(torque)
        bounds = span(code, "T", torque)
        self.guard(bounds, edges, row("t_low"), row("t_high"))
        self.peak(bounds, block, row("torque_max"))
        force = code.series("e", row("force"), layout.coefficients)
        damping = f" + {code.row(row('rate'))}*({' + '.join(relative)})" if layout.drag else ""
        self._check_law(torque, f"{horner(force, windup.end)}{damping}", row("locked"), row("allowed"))
        angle = primitive_span(code, "phi", code.load("phi", row("phi")), w[:-1], self.h)
        self.peak(angle, block, row("phi_max"), row("phi_min"))
        self.peak(span(code, "w", w), block, row("speed_max"), row("speed_min"))
        self.peak(rate_span(code, "a", w, self.inverse_h), block, row("acc_max"), row("acc_min"))

    def _check_law(self, torque: list[Term], law: str, locked: int, allowed: int) -> None:
        """Lower the margin where the step is too long for the clutch's law.

        The step is chosen by two coefficients. A law without a linear term, entered from uniform motion, has a series
        in which most coefficients vanish, these two perhaps among them: only the defect of the torque's series at the
        step's end tells.
        """
        code = self.code
        end = code.let("torque_end", " + ".join(torque))
        defect = code.let("defect", f"abs({law} - {end})*(1.0 - {code.row(locked)})")
        most = code.let("most", f"{code.row(allowed)} + {_TORQUE_ROUNDING!r}*abs({end})")
        self.margin = code.let("margin", f"{self.margin} if {defect} <= {most} else {TOO_LONG!r}")

    def shaft(self) -> None:
        """Watch the shaft and what all clutches do together."""
        layout, code = self.layout, self.code
        block = layout.x_speed_max - layout.speed_max
        edges = layout.m_sum_high - layout.sum_high
        speeds = span(code, "W", self.speed)
        self.guard(speeds, edges, layout.speed_low, layout.speed_high if layout.tabled else None)
        self.peak(speeds, block, layout.speed_max, layout.speed_min)
        self.peak(rate_span(code, "A", self.speed, self.inverse_h), block, layout.acc_max)
        total = self.torques[0]
        if layout.n > 1:
            total = [code.let("S", " + ".join(parts)) for parts in zip(*self.torques, strict=True)]
        sums = span(code, "S", total)
        self.guard(self._held_excess(total) if layout.ramped else sums, edges, None, layout.sum_high)
        if layout.n > 1:
            self.peak(sums, block, layout.sum_max)
        corners = [code.let("corner", f"({a})*({b})") for a in (sums.low, sums.high) for b in (speeds.low, speeds.high)]
        highest = corners[0]
        for corner in corners[1:]:
            highest = code.let("highest", larger(corner, highest))
        self._exceed(layout.power_max + block, f"{highest} - {code.row(layout.power_max)}")
        if layout.curved:
            # No term of the load pushes, so that its power is largest where all are.
            curve = span(code, "B", code.series("B", layout.curve, layout.order + 1))
            fastest = code.let("fastest", larger(speeds.high, "0.0"))
            rising = f"({code.row(layout.generator)} + {code.row(layout.quadratic)}*{fastest})*{fastest}"
            most = f"({code.row(layout.load)} + {rising} + ({curve.high}))*{fastest}"
            self._exceed(layout.useful_max + block, f"{most} - {code.row(layout.useful_max)}")

    def _held_excess(self, total: list[Term]) -> Span:
        """The sum of the torques less the changing load that holds the shaft, as `states.held_excess`."""
        layout, code = self.layout, self.code
        held = code.load("held", layout.held_load)
        value = code.let("excess_0", f"{total[0]} - {code.row(layout.load_factor)}*{held}")
        rate = code.let("excess_1", f"{total[1]} - {code.row(layout.load_slope)}*{held}*{self.h}")
        return span(code, "X", [value, rate, *total[2:]])


def bounds_loop(layout: Layout) -> str:
    """Source of the loop that bounds everything watched."""
    watch = _Watch(layout)
    for index in range(layout.n):
        watch.pendulum(index)
    watch.shaft()
    watch.code.store(layout.margin, watch.margin)
    watch.code.store(layout.excess, watch.excess)
    return watch.code.loop()
