"""State and sums of every lane at the end of the part x of its step, from the stored series."""

import math

from sprag_study.engine.taylor.straight import ROUND, LaneCode, Term, horner, integral, product, square
from sprag_study.engine.vibration_drive.layout import Layout

#: Smallest step, in excitation periods: below it a step no longer moves the phase.
STEP_FLOOR = 1e-13
#: Angle (rad) and speed (rad/s) beyond which a case has diverged.
ANGLE_BOUND = 1e6
SPEED_BOUND = 1e9


class _Advance:
    """Code of the lane loop that moves states and adds to sums."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self.code = code = LaneCode(layout.lanes, "_m")
        self.x = code.load("x", layout.x)
        self.h = code.load("h", layout.h)
        self.taken = code.let("taken", f"{self.x}*{self.h}")
        self.shaft = code.series("W", layout.speed, layout.order + 1)
        self.attention = code.load("at_stop", layout.at_stop)
        self.torques: list[list[Term]] = []

    def add(self, row: int, amount: str) -> None:
        """Add to the sum at ``row``."""
        self.code.store(row, f"{self.code.row(row)} + {amount}")

    def over(self, names: list[Term]) -> str:
        """Integral of a series over the time taken."""
        return self.code.let("over", f"{self.h}*({integral(names, self.x)})")

    def require(self, condition: str) -> None:
        """Mark the lane for attention where a condition fails; a NaN fails every comparison."""
        self.attention = self.code.let("attention", f"{self.attention} + (0.0 if {condition} else 1.0)")

    def pendulum(self, index: int) -> None:
        """Move one pendulum."""
        code, order = self.code, self.layout.order
        base = self.layout.pendulums + index * self.layout.stride

        def row(name: str) -> int:
            offset: int = getattr(self.layout, f"p_{name}")
            return base + offset

        w = code.series("w", row("speed"), order + 1)
        drive = code.series("D", row("drive"), order)
        angle = [
            code.load("phi", row("phi")),
            *(code.let("phi", f"{self.h}*{w[k]}*{1.0 / (k + 1)!r}") for k in range(order)),
        ]
        self.add(row("sum_phi"), self.over(angle))
        torque = code.series("T", row("torque"), order + 1)
        self.torques.append(torque)
        self.add(row("sum_torque"), self.over(torque))
        self.add(row("work_input"), self.over([code.let("I", product(w, drive, k)) for k in range(order)]))
        self.add(row("work_loss"), self.over([code.let("Q", square(w, k)) for k in range(order)]))
        self.add(row("time_engaged"), f"{code.row(row('engaged'))}*{self.taken}")
        self.add(row("time_beyond"), f"{code.row(row('beyond'))}*{self.taken}")
        self.add(row("u"), self.over([code.let("v", f"{w[k]} - {self.shaft[k]}") for k in range(order)]))
        phi_end = code.let("phi_end", horner(angle, self.x))
        w_end = code.let("w_end", horner(w, self.x))
        if self.layout.drag:
            relative = [code.let("V", f"{w[k]} - {self.shaft[k]}") for k in range(order + 1)]
            lost = self.over([code.let("K", square(relative, k)) for k in range(order + 1)])
            self.add(row("work_clutch"), f"{code.row(row('rate'))}*{lost}")
        code.store(row("phi"), phi_end)
        code.store(row("speed"), w_end)
        self.require(f"abs({phi_end}) < {ANGLE_BOUND!r}")
        self.require(f"abs({w_end}) < {SPEED_BOUND!r}")

    def ramps(self) -> None:
        """Move phase and frequency of the excitation, and the factor on the load."""
        layout, code = self.layout, self.code
        rate, slope = code.load("rate", layout.phase_rate), code.load("slope", layout.phase_slope)
        gained = code.let("gained", f"({rate} + 0.5*{slope}*{self.taken})*{self.taken}*{0.5 / math.pi!r}")
        phase = code.let("phase", f"{code.row(layout.phase)} + {gained}")
        code.store(layout.phase, f"{phase} - (({phase} + {ROUND}) - {ROUND})")
        self.add(layout.phase_rate, f"{slope}*{self.taken}")
        self.add(layout.load_factor, f"{code.row(layout.load_slope)}*{self.taken}")

    def shaft_and_clock(self) -> None:
        """Move the shaft and the clock; determine whether the lane needs attention."""
        layout, code = self.layout, self.code
        rotating = code.load("rotating", layout.rotating)
        total = [code.let("S", " + ".join(parts)) for parts in zip(*self.torques, strict=True)]
        power = [code.let("P", product(total, self.shaft, k)) for k in range(layout.order + 1)]
        self.add(layout.sum_held, f"(1.0 - {rotating})*({self.over(total)})")
        self.add(layout.work_clutch, self.over(power))
        if layout.drag:
            squares = [code.let("R", square(self.shaft, k)) for k in range(layout.order + 1)]
            cubes = [code.let("C", product(squares, self.shaft, k)) for k in range(layout.order + 1)]
            self.add(layout.speed_square, self.over(squares))
            self.add(layout.speed_cube, self.over(cubes))
        if layout.curved:
            curve = code.series("B", layout.curve, layout.order + 1)
            self.add(layout.curve_impulse, f"{rotating}*({self.over(curve)})")
            against = [code.let("L", product(curve, self.shaft, k)) for k in range(layout.order + 1)]
            self.add(layout.curve_work, self.over(against))
        self.add(layout.time_held, f"(1.0 - {rotating})*{self.taken}")
        self.add(layout.time_rotating, f"{rotating}*{self.taken}")
        self.add(layout.time_driven, f"{code.row(layout.driven)}*{self.taken}")
        turned = self.over(self.shaft)
        self.add(layout.turn, turned)
        if layout.curved:
            cycle = code.let("cycle", f"{code.row(layout.cycle)} + {code.row(layout.cycles)}*{turned}")
            whole = code.let("whole", f"({cycle}*{0.5 / math.pi!r} + {ROUND}) - {ROUND}")
            code.store(layout.cycle, f"{cycle} - {whole}*{2.0 * math.pi!r}")
        if layout.ramped:
            self.ramps()
        speed_end = code.let("speed_end", horner(self.shaft, self.x))
        code.store(layout.speed, speed_end)
        self.add(layout.f, f"{self.taken}/{code.row(layout.period)}")
        steps = code.let("steps", f"{code.row(layout.steps)} + (1.0 if {self.taken} > 0.0 else 0.0)")
        code.store(layout.steps, steps)
        self.require(f"abs({speed_end}) < {SPEED_BOUND!r}")
        self.require(f"{code.row(layout.h_free)} > {STEP_FLOOR!r}*{code.row(layout.period)}")
        self.require(f"{steps} < {code.row(layout.most_steps)}")
        # An event is looked for, and found, only where the margin is gone.
        self.require(f"{code.row(layout.margin)} > 0.0")
        code.store(layout.attention, self.attention)


def advance_loop(layout: Layout) -> str:
    """Source of the loop that moves every lane by the part x of its step."""
    move = _Advance(layout)
    for index in range(layout.n):
        move.pendulum(index)
    move.shaft_and_clock()
    return move.code.loop()
