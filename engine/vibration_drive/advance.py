"""State and sums of every lane at the end of the part x of its step, from the stored series."""

from engine.taylor.straight import LaneCode, horner, integral, product
from engine.vibration_drive.layout import Layout

#: Smallest step, in excitation periods: below it a step no longer moves the phase.
STEP_FLOOR = 1e-13
#: Angle (rad) and speed (rad/s) beyond which a case has diverged.
ANGLE_BOUND = 1e6
SPEED_BOUND = 1e9


class _Advance:
    """Code of one lane loop that moves states and adds to sums."""

    def __init__(self, layout: Layout, tag: str) -> None:
        self.layout = layout
        self.code = LaneCode(layout.lanes, f"_m{tag}")
        self.x = self.code.load("x", layout.x)
        self.h = self.code.load("h", layout.h)
        self.taken = self.code.let("taken", f"{self.x}*{self.h}")

    def add(self, row: int, amount: str) -> None:
        """Add to the sum at ``row``."""
        self.code.store(row, f"{self.code.row(row)} + {amount}")

    def over(self, names: list[str]) -> str:
        """Integral of a series over the time taken."""
        return f"{self.h}*({integral(names, self.x)})"

    def of_product(self, tag: str, a: list[str], b: list[str]) -> str:
        """Integral of the product of two series over the time taken."""
        return self.over([self.code.let(f"{tag}{k}", product(a, b, k)) for k in range(self.layout.order)])


def pendulum_advance(layout: Layout, index: int) -> str:
    """Source of the loop over one pendulum; it must run before the shaft's, whose speed it needs as it was."""
    move = _Advance(layout, str(index))
    code, order = move.code, layout.order
    base = layout.pendulums + index * layout.stride

    def row(name: str) -> int:
        offset: int = getattr(layout, f"p_{name}")
        return base + offset

    shaft = code.series("W", layout.speed, order)
    w = code.series("w", row("speed"), order + 1)
    angle = [
        code.load("phi", row("phi")),
        *(code.let(f"phi{k + 1}", f"{move.h}*{w[k]}*{1.0 / (k + 1)!r}") for k in range(order)),
    ]
    move.add(row("sum_phi"), move.over(angle))
    move.add(row("sum_torque"), move.over(code.series("T", row("torque"), order + 1)))
    move.add(row("work_input"), move.of_product("I", w, code.series("D", row("drive"), order)))
    move.add(row("work_loss"), move.of_product("Q", w, w))
    move.add(row("time_engaged"), f"{code.row(row('engaged'))}*{move.taken}")
    move.add(row("time_beyond"), f"{code.row(row('beyond'))}*{move.taken}")
    move.add(row("u"), move.over([code.let(f"v{k}", f"{w[k]} - {shaft[k]}") for k in range(order)]))
    phi_end = code.let("phi_end", horner(angle, move.x))
    w_end = code.let("w_end", horner(w, move.x))
    code.store(row("phi"), phi_end)
    code.store(row("speed"), w_end)
    bounded = code.let("bounded", f"1.0 if abs({phi_end}) < {ANGLE_BOUND!r} else 0.0")
    slow = code.let("slow", f"1.0 if abs({w_end}) < {SPEED_BOUND!r} else 0.0")
    before = code.row(layout.attention) if index > 0 else "0.0"
    code.store(layout.attention, f"{before} + (1.0 - {bounded}*{slow})")
    return code.loop()


def shaft_advance(layout: Layout) -> str:
    """Source of the loop over the shaft and the clock; it settles whether the lane needs attention."""
    move = _Advance(layout, "s")
    code, order = move.code, layout.order
    shaft = code.series("W", layout.speed, order + 1)
    rotating = code.load("rotating", layout.rotating)
    move.add(layout.sum_held, f"(1.0 - {rotating})*({move.over(code.series('S', layout.sum, order + 1))})")
    move.add(layout.time_held, f"(1.0 - {rotating})*{move.taken}")
    move.add(layout.time_rotating, f"{rotating}*{move.taken}")
    move.add(layout.time_driven, f"{code.row(layout.driven)}*{move.taken}")
    move.add(layout.work_clutch, move.over(code.series("P", layout.power, order + 1)))
    move.add(layout.turn, move.over(shaft))
    speed_end = code.let("speed_end", horner(shaft, move.x))
    code.store(layout.speed, speed_end)
    move.add(layout.f, f"{move.taken}/{code.row(layout.period)}")
    steps = code.let("steps", f"{code.row(layout.steps)} + (1.0 if {move.taken} > 0.0 else 0.0)")
    code.store(layout.steps, steps)
    conditions = (
        f"abs({speed_end}) < {SPEED_BOUND!r}",
        f"{code.row(layout.h_free)} > {STEP_FLOOR!r}*{code.row(layout.period)}",
        f"{steps} < most_steps",
        # An event is looked for, and found, only where the margin is gone.
        f"{code.row(layout.margin)} > 0.0",
    )
    attention = code.let("attention", f"{code.row(layout.attention)} + {code.row(layout.at_stop)}")
    for condition in conditions:
        # A NaN fails every comparison.
        attention = code.let("attention", f"{attention} + (0.0 if {condition} else 1.0)")
    code.store(layout.attention, attention)
    return code.loop()
