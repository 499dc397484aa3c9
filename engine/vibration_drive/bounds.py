"""Bounds of every watched quantity over a step: how far guards keep from their bands, how far extrema may be exceeded.

They are made in the vector loops, from the stored series; only lanes whose bounds cannot exclude an event or a new
extremum get a second look (``lanes.look_for_events``, ``window.collect_peaks``).
"""

from engine.taylor.straight import LaneCode, horner, larger, range_bounds, smaller
from engine.vibration_drive.layout import Layout

#: Margin that says the step itself is too long, not that a guard is near.
TOO_LONG = -1e308


class _Watch:
    """Code of one lane loop that lowers the lane's ``margin`` and raises its ``excess``."""

    def __init__(self, layout: Layout, tag: str, first: bool) -> None:
        self.layout = layout
        self.code = LaneCode(layout.lanes, f"_b{tag}")
        self.margin = self.code.let("margin", "1e300" if first else self.code.row(layout.margin))
        self.excess = self.code.let("excess", "-1e300" if first else self.code.row(layout.excess))
        self.h = self.code.load("h", layout.h)
        self.inverse_h = self.code.let("inverse_h", f"1.0/{self.h}")

    def guard(self, bounds: tuple[str, str], block: int, low: int | None, high: int | None) -> None:
        """``low`` and ``high`` are rows of a band's edges; the distances to them go ``block`` rows further."""
        for text, row in ((f"{bounds[0]} - {{}}", low), (f"{{}} - {bounds[1]}", high)):
            if row is not None:
                gap = self.code.let("gap", text.format(self.code.row(row)))
                self.code.store(row + block, gap)
                self.margin = self.code.let("margin", smaller(gap, self.margin))

    def peak(self, bounds: tuple[str, str], block: int, high: int, low: int | None = None) -> None:
        """``high`` and ``low`` are rows of known extrema; their excess goes ``block`` rows further."""
        for text, row in ((f"{bounds[1]} - {{}}", high), (f"{{}} - {bounds[0]}", low)):
            if row is not None:
                gap = self.code.let("gap", text.format(self.code.row(row)))
                self.code.store(row + block, gap)
                self.excess = self.code.let("excess", larger(gap, self.excess))

    def rates(self, names: list[str]) -> list[str]:
        """Time derivative of a series."""
        order = self.layout.order
        return [self.code.let(f"R_{k}", f"{names[k + 1]}*{self.inverse_h}*{k + 1.0!r}") for k in range(order)]

    def primitive(self, tag: str, start: str, names: list[str]) -> list[str]:
        """Time integral of a series from the value ``start``."""
        order = self.layout.order
        return [
            start,
            *(self.code.let(f"{tag}{k + 1}", f"{self.h}*{names[k]}*{1.0 / (k + 1)!r}") for k in range(order)),
        ]

    def loop(self) -> str:
        """The finished loop."""
        self.code.store(self.layout.margin, self.margin)
        self.code.store(self.layout.excess, self.excess)
        return self.code.loop()


def shaft_bounds(layout: Layout) -> str:
    """Source of the loop over the shaft's quantities; it starts ``margin`` and ``excess`` afresh."""
    watch = _Watch(layout, "s", first=True)
    code = watch.code
    count = layout.order + 1
    block = layout.x_speed_max - layout.speed_max
    edges = layout.m_sum_high - layout.sum_high
    shaft = code.series("W", layout.speed, count)
    bounds = range_bounds(code, "W", shaft)
    watch.guard(bounds, edges, layout.speed_low, None)
    watch.peak(bounds, block, layout.speed_max, layout.speed_min)
    bounds = range_bounds(code, "S", code.series("S", layout.sum, count))
    watch.guard(bounds, edges, None, layout.sum_high)
    watch.peak(bounds, block, layout.sum_max)
    watch.peak(range_bounds(code, "R", watch.rates(shaft)), block, layout.acc_max)
    watch.peak(range_bounds(code, "P", code.series("P", layout.power, count)), block, layout.power_max)
    return watch.loop()


def pendulum_bounds(layout: Layout, index: int) -> str:
    """Source of the loop over the quantities of one pendulum and its clutch."""
    watch = _Watch(layout, str(index), first=False)
    code = watch.code
    count = layout.order + 1
    base = layout.pendulums + index * layout.stride

    def row(name: str) -> int:
        offset: int = getattr(layout, f"p_{name}")
        return base + offset

    block = layout.p_x_phi_max - layout.p_phi_max
    edges = layout.p_m_w_low - layout.p_w_low
    shaft = code.series("W", layout.speed, count)
    w = code.series("w", row("speed"), count)
    relative = [code.let(f"v{k}", f"{w[k]} - {shaft[k]}") for k in range(count)]
    watch.guard(range_bounds(code, "v", relative), edges, row("w_low"), row("w_high"))
    u = watch.primitive("u", code.load("u_start", row("u")), relative)
    bounds = range_bounds(code, "u", u)
    watch.guard(bounds, edges, row("u_low"), row("u_high"))
    watch.peak(bounds, block, row("u_max"))
    torque = code.series("T", row("torque"), count)
    bounds = range_bounds(code, "T", torque)
    watch.guard(bounds, edges, row("t_low"), row("t_high"))
    watch.peak(bounds, block, row("torque_max"))
    force = code.series("e", row("force"), layout.coefficients)
    # The step is chosen by two coefficients. A law without a linear term, entered from uniform motion, has a series in
    # which most coefficients vanish, these two perhaps among them: only the defect of the torque's series at the step's
    # end tells that the step is too long.
    torque_end = code.let("torque_end", " + ".join(torque))
    law = horner(force, code.let("u_end", " + ".join(u)))
    defect = code.let("defect", f"abs({law} - {torque_end})*(1.0 - {code.row(row('locked'))})")
    watch.margin = code.let("margin", f"{watch.margin} if {defect} <= {code.row(row('allowed'))} else {TOO_LONG!r}")
    phi = watch.primitive("p", code.load("phi_start", row("phi")), w)
    watch.peak(range_bounds(code, "p", phi), block, row("phi_max"), row("phi_min"))
    watch.peak(range_bounds(code, "w", w), block, row("speed_max"), row("speed_min"))
    watch.peak(range_bounds(code, "R", watch.rates(w)), block, row("acc_max"), row("acc_min"))
    return watch.loop()
