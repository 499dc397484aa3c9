"""One transient of a machine on its panels: its start, its integration, and its results."""

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from sprag_study.engine.endings import Ending
from sprag_study.engine.machine_shaft import transient_kernel as kernel
from sprag_study.engine.machine_shaft.motor import characteristic, motor_torque
from sprag_study.engine.machine_shaft.motor_tables import MotorTable
from sprag_study.engine.machine_shaft.panels import COEFFICIENTS, INTEGRAL, RUNNING, SAMPLES, TAIL, WEIGHTS, apply
from sprag_study.engine.machine_shaft.transient_bench import Bench, Cycle
from sprag_study.engine.machine_shaft.transient_causes import Ends
from sprag_study.engine.machine_shaft.transient_course import Course, Outcome
from sprag_study.engine.quadrature import product
from sprag_study.sentences import Sentence

Floats = NDArray[np.float64]

#: The outcomes by the number that the kernel gives.
OUTCOMES: tuple[Outcome, ...] = ("reached", "stopped", "not_started", "not_reached", "too_stiff")
_TO_INTEGRAL = product(INTEGRAL, COEFFICIENTS)
_TURN = 2.0 * np.pi
_FIXED_DRIVE = Sentence("The torque of the drive does not follow the speed, so it balances no other load.")


class Run:
    """One transient of a machine on its panels; ``missed`` is a steady cycle to which it does not come."""

    def __init__(
        self, bench: Bench, course: Course, before: Cycle | None, after: Cycle | None, missed: Cycle | None = None
    ) -> None:
        self.bench, self.course, self.before, self.after, self.missed = bench, course, before, after, missed
        panels, train = bench.panels, bench.machine.train
        self.cuts = np.ascontiguousarray(panels.cuts[0])
        self.pieces = np.full((1, 6), np.inf)
        self.drive = np.zeros_like(bench.drive) if course.kind == "coasting" else bench.drive
        if course.kind == "run-up" and not bench.motor:
            torque = train.at_shaft(np.full((1, 1, 1), course.torque))
            self.drive = np.ascontiguousarray(np.broadcast_to(torque, bench.drive.shape))
        self.numbers = np.zeros(9)
        self.numbers[kernel.FASTEST] = bench.fastest(before, after)
        self.loads = bench.resistance(course.load, float(self.numbers[kernel.FASTEST]))
        self.numbers[kernel.FARTHEST] = course.angle + _TURN * course.revolutions
        if bench.motor and course.kind != "coasting":
            self._switch_on()
        self.state = self._begin()
        target = np.ones_like(self.drive) if after is None else after.energy
        self.tables = bench.table(bench.fields.inertia, self.drive, target, *self.loads)
        if after is not None:
            self._aim(after)

    def _switch_on(self) -> None:
        names = {"linear": ("no_load_speed", "stall_torque"),
                 "kloss": ("synchronous_speed", "breakdown_torque", "breakdown_slip"),
                 "table": ("unit_speed", "scale")}  # fmt: skip
        kind = self.bench.model.drive.motor or "linear"
        own = {name: float(value[0, 0, 0]) for name, value in self.bench.motor.items()}
        self.numbers[kernel.KIND] = 1.0 + tuple(names).index(kind)
        self.numbers[kernel.EFFICIENCY] = own.get("efficiency", 1.0)
        for place, name in enumerate(names[kind], start=kernel.FIRST):
            self.numbers[place] = own.get(name, 1.0)
        motor = characteristic(self.bench.model.drive)
        if isinstance(motor, MotorTable):
            self.pieces = motor.pieces()

    def _begin(self) -> Floats:
        """The state at the start: at rest, or in the steady cycle before."""
        panel = int(np.clip(np.searchsorted(self.cuts, self.course.angle, side="right") - 1, 0, len(self.cuts) - 2))
        low, high = self.cuts[panel], self.cuts[panel + 1]
        state = np.zeros(5)
        state[kernel.PANEL] = panel
        state[kernel.PLACE] = np.clip(2.0 * (self.course.angle - low) / (high - low) - 1.0, -1.0, 1.0)
        if self.before is not None:
            state[kernel.ROOT] = np.sqrt(2.0 * self._value(self.before.energy, state))
        return state

    def _value(self, values: Floats, state: Floats) -> float:
        """Values at the nodes as of a state."""
        series = apply(COEFFICIENTS, values)[0, int(state[kernel.PANEL])]
        return float(legendre.legval(float(state[kernel.PLACE]), series))

    def _aim(self, after: Cycle) -> None:
        """Set the side from which the steady cycle is approached, and the deviation that counts as reached."""
        root = np.sqrt(2.0 * self._value(after.energy, self.state))
        side = 1.0 if self.state[kernel.ROOT] <= root else -1.0
        self.numbers[kernel.SIDE] = side
        self.numbers[kernel.FACTOR] = 1.0 + self.course.within * (self.state[kernel.ROOT] / root - 1.0)

    def follow(self, times: Floats) -> tuple[int, Floats, Floats]:
        """Integrate it: the status, the totals, and angle and u at the ``times``."""
        totals, out = np.zeros(kernel.TOTALS), np.zeros((len(times), 2))
        start = self.omega(self.state)
        totals[kernel.SPEED_MAX] = totals[kernel.SPEED_MIN] = start
        totals[kernel.TORQUE_MAX] = totals[kernel.POWER_MAX] = -np.inf
        status = kernel.follow(
            self.cuts, self.tables, self.numbers, self.pieces, self.state.copy(), times, out, totals, RUNNING, WEIGHTS,
            TAIL, COEFFICIENTS, _TO_INTEGRAL, SAMPLES,
        )  # fmt: skip
        return int(status), totals, out

    def omega(self, state: Floats) -> float:
        """Speed of a state."""
        return float(state[kernel.ROOT] / np.sqrt(self._value(self.bench.fields.inertia, state)))

    def results(self, outcome: Outcome, totals: Floats) -> dict[str, float]:
        """Every result by name."""
        course, bench = self.course, self.bench
        done = outcome == ("stopped" if course.kind == "coasting" else "reached")
        energy, begun = float(totals[kernel.ENERGY]), 0.5 * np.square(float(self.state[kernel.ROOT]))
        drive, resistance = float(totals[kernel.WORK_DRIVE]), float(totals[kernel.WORK_RESISTANCE])
        largest = max(abs(drive), abs(resistance), energy, begun)
        end = np.mod(totals[kernel.ANGLE], bench.cycle)
        torque = np.nan if np.isinf(totals[kernel.TORQUE_MAX]) else float(totals[kernel.TORQUE_MAX])
        slip = bench.model.drive.motor == "kloss" and bool(bench.motor) and course.kind != "coasting"
        return {
            "time": float(totals[kernel.TIME]) if done else np.nan,
            "duration": float(totals[kernel.TIME]),
            "turns": float(totals[kernel.ANGLE] - course.angle) / _TURN,
            "omega.start": self.omega(self.state),
            "omega.end": float(np.sqrt(2.0 * energy / bench.at(bench.fields.inertia, np.array([end]))[0])),
            "omega.max": float(totals[kernel.SPEED_MAX]),
            "omega.min": float(totals[kernel.SPEED_MIN]),
            "drive_torque.max": torque,
            "motor.torque.max": float(bench.machine.train.at_motor(np.full((1, 1, 1), torque))[0, 0, 0]),
            "power.max": np.nan if np.isnan(torque) else float(totals[kernel.POWER_MAX]),
            "work.drive": drive,
            "work.resistance": resistance,
            "work.slip": float(totals[kernel.WORK_SLIP]) if slip else np.nan,
            "energy.change": energy - begun,
            "balance.energy": abs(energy - begun - drive - resistance) / largest if largest > 0.0 else 0.0,
            "before.omega.mean": np.nan if self.before is None else self.before.mean,
            "after.omega.mean": np.nan if self.after is None else self.after.mean,
            "after.irregularity": np.nan if self.after is None else self.after.irregularity,
        }

    def ends(self, totals: Floats, ending: Ending) -> Ends:
        """Torques at the end, for the sentence about its cause."""
        bench = self.bench
        angle = np.array([np.mod(totals[kernel.ANGLE], bench.cycle)])
        standing, most = float(bench.at(self.drive, angle)[0]), float(self.drive.max())
        if self.numbers[kernel.KIND] > 0.0:
            standing = float(self._pull(np.zeros(1))[0])
            most = standing
            if self.numbers[kernel.KIND] == 2.0 and self.numbers[kernel.THIRD] < 1.0:
                most = float(self.numbers[kernel.SECOND] * self.numbers[kernel.EFFICIENCY])
            elif self.numbers[kernel.KIND] == 3.0:
                most = float(self._pull(np.linspace(0.0, self.numbers[kernel.FASTEST], 2001)).max())
        resisting = self.load_at(np.zeros(self.drive.shape))
        friction = float(self.bench.row.row("friction_torque")[0])
        return Ends(
            angle=float(angle[0]),
            drive=standing,
            largest_drive=most,
            resistance=float(bench.at(resisting, angle)[0]),
            mean_resistance=float(bench.panels.integral(resisting)[0]) / bench.cycle,
            turns_back=float(bench.at(bench.passive, angle)[0]) + 2.0 * friction < 0.0,
            within=self.course.within,
            cycle=self.after is not None,
            missed=np.nan if self.missed is None else self.missed.mean,
            no_cycle=_FIXED_DRIVE if ending is Ending.OK else ending.sentence,
        )

    def load_at(self, omega: Floats, angle: Floats | None = None) -> Floats:
        """Resisting torque at speeds: at the nodes, or at angles of that shape."""
        z = 2.0 * omega / self.numbers[kernel.FASTEST] - 1.0
        terms = self.loads if angle is None else [self.bench.at(own, angle) for own in self.loads]
        before, now = np.ones_like(z), z
        total = terms[0] + 0.0 * z
        for own in terms[1:]:
            total = total + own * now
            before, now = now, 2.0 * z * now - before
        return np.asarray(total)

    def _pull(self, omega: Floats) -> Floats:
        """Torque of the motor on the main shaft at speeds, shape (m,)."""
        if self.numbers[kernel.KIND] == 0.0 or self.bench.model.drive.motor is None:
            return np.zeros_like(omega)
        own = {name: value[0, 0] for name, value in self.bench.motor.items()}
        return motor_torque(characteristic(self.bench.model.drive), own, omega)[0]

    def values(self, places: Floats) -> Floats:
        """The columns of the table from angles and u, shape (m, columns)."""
        bench = self.bench
        angle, u = np.mod(places[:, 0], bench.cycle), places[:, 1]
        inertia, slope = bench.at(bench.fields.inertia, angle), bench.at(bench.fields.slope, angle)
        omega = u / np.sqrt(inertia)
        drive, resistance = bench.at(self.drive, angle) + self._pull(omega), self.load_at(omega, angle)
        acceleration = (drive + resistance - 0.5 * np.square(omega) * slope) / inertia
        energy = 0.5 * u * u
        return np.column_stack([places[:, 0], omega, acceleration, energy, inertia, drive, resistance, drive * omega])
