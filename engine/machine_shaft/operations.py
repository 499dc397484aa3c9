"""The resistance of the operation, and the weight and spring of a mechanism, as torques on the shaft."""

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine import elementary
from sprag_study.engine.formulas.expressions import MEAN_SPEED, Expression
from sprag_study.engine.machine_shaft.mechanisms import Values
from sprag_study.engine.machine_shaft.roots import switches
from sprag_study.engine.machine_shaft.spec import OperationChoice
from sprag_study.engine.machine_shaft.strokes import Stroke
from sprag_study.engine.machine_shaft.tables import Curve, along_strokes, over_stroke, periodic

Floats = NDArray[np.float64]
#: Torque on the shaft in N*m at speeds of the shaft in rad/s, and its derivative by the speed.
SpeedLaw = Callable[[Floats], tuple[Floats, Floats]]

_TURN = 2.0 * np.pi
#: Samples per revolution in the search for sign changes of a formula.
_SAMPLES = 720


def every_revolution(angles: Floats, revolutions: int) -> Floats:
    """Angles (cases, 1, n) of one revolution in every revolution of the cycle, shape (cases, n * revolutions)."""
    flat = np.mod(angles[:, 0, :], _TURN)
    return np.concatenate([flat + _TURN * k for k in range(revolutions)], axis=1)


def formula_breaks(
    expression: Expression,
    environment: Callable[[Floats], Mapping[str, tuple[Floats, Floats | float]]],
    revolutions: int,
) -> list[Floats]:
    """Angles at which a formula jumps or has a kink, arrays of shape (cases or 1, n), NaN where a case has fewer."""
    count = _SAMPLES * revolutions
    # Shifted slightly, so that no sample lies at a round angle.
    grid = (np.linspace(0.0, _TURN * revolutions, count + 1) + 1e-4)[None, None, :]
    breaks = []
    for index in range(expression.switch_count):

        def sign(phi: Floats, index: int = index) -> Floats:
            value = np.asarray(expression.switch(index, environment(phi)))
            return np.where(np.broadcast_to(value, np.broadcast_shapes(value.shape, phi.shape)) >= 0.0, 1.0, -1.0)

        samples = sign(np.concatenate([grid[..., :1] - 2e-4, grid], axis=2))[:, 0, :]
        changes = samples[:, 1:] != samples[:, :-1]
        most = int(changes.sum(axis=1).max(initial=0))
        if most == 0:
            continue
        low = np.full((len(samples), 1, most), np.nan)
        for case, row in enumerate(changes):
            places = np.nonzero(row)[0]
            low[case, 0, : len(places)] = places
        edges = np.concatenate([grid[0, 0, :1] - 2e-4, grid[0, 0]])
        known = ~np.isnan(low)
        place = np.where(known, low, 0.0).astype(np.int64)
        found = switches(sign, edges[place], edges[place + 1])
        breaks.append(np.where(known, np.mod(found, _TURN * revolutions), np.nan)[:, 0, :])
    return breaks


def reachable_pressure(suction: Floats, clearance: Floats, exponent: Floats) -> Floats:
    """Pressure (Pa) that a compressor reaches at its head; infinite without clearance."""
    with np.errstate(divide="ignore", over="ignore"):
        return np.asarray(suction * elementary.power((1.0 + clearance) / clearance, exponent))


class Operation:
    """The prepared resistance of the operation.

    Parameters
    ----------
    choice : OperationChoice
    revolutions : int
        Of a cycle.
    values : mapping
        Values of the parameters under ``operation.`` without that prefix, each of shape (cases or 1, 1, 1).
    constants : mapping
        The formulas' constants, of that shape.
    stroke : Stroke or None
        Of the mechanism, if it has one.
    pace : array of that shape
        Speed of the shaft in rad/s that a formula takes for ``omega`` where no other is given.
    """

    def __init__(
        self,
        choice: OperationChoice,
        revolutions: int,
        values: Values,
        constants: Values,
        stroke: Stroke | None,
        pace: Floats,
    ) -> None:
        self._choice, self._revolutions, self._values = choice, revolutions, values
        self._constants, self._stroke, self._pace = constants, stroke, pace
        self._cycle = _TURN * revolutions
        self._curve: Curve | None = None
        self._expression: Expression | None = None
        self._strokes: tuple[Curve, ...] = ()
        if choice.quantity == "pressure" and choice.over == "stroke" and choice.table is not None:
            self._strokes = along_strokes(choice.table, 2 * revolutions)
        elif choice.table is not None and choice.form == "table":
            self._curve = over_stroke(choice.table) if choice.over == "stroke" else periodic(choice.table, self._cycle)
        if choice.formula is not None and choice.form == "formula":
            names = ("phi", "x") if stroke is not None else ("phi",)
            self._expression = Expression(choice.formula, dict.fromkeys((*names, "omega", MEAN_SPEED, *constants)))

    def _environment(self, phi: Floats) -> dict[str, tuple[Floats, Floats | float]]:
        names: dict[str, tuple[Floats, Floats | float]] = {"phi": (phi, 0.0)}
        if self._stroke is not None:
            names["x"] = (self._stroke.fraction(phi), 0.0)
        if self.follows_speed:
            names["omega"] = (self._pace, 0.0)
        if self.uses_time:
            names[MEAN_SPEED] = (self._pace, 0.0)
        return names | {name: (value, 0.0) for name, value in self._constants.items()}

    @property
    def follows_speed(self) -> bool:
        """Whether its formula uses the speed of the shaft, ``omega``."""
        own = self.expression
        return own is not None and "omega" in own.used and "omega" not in self._constants

    @property
    def uses_time(self) -> bool:
        """Whether its formula uses ``t``, the time in which an even shaft comes to ``phi``."""
        own = self.expression
        return own is not None and MEAN_SPEED in own.used

    @property
    def loses(self) -> bool:
        """Whether less of its power arrives than is sent."""
        return self._charged and self._choice.efficiency_is == "power"

    @property
    def _charged(self) -> bool:
        efficiency = self._values.get("efficiency")
        return self._choice.quantity != "none" and efficiency is not None and bool((efficiency != 1.0).any())

    @property
    def loses_evenly(self) -> bool:
        """Whether a share of its work in a cycle is lost, as a constant torque."""
        return self._charged and self._choice.efficiency_is == "work"

    def even_loss(self, mean: Floats) -> Floats:
        """Torque in N*m that the losses take at every angle, for a ``mean`` torque of the operation over the cycle."""
        efficiency = self._values["efficiency"]
        return np.asarray(np.where(mean > 0.0, mean * (1.0 - efficiency), -mean * (1.0 / efficiency - 1.0)))

    def switch(self, index: int, phi: Floats, omega: Floats) -> Floats:
        """Value of a switch of a formula that follows the speed, at its own angles and the speeds there."""
        if self._expression is None:
            raise AssertionError("only a formula has switches")
        return np.asarray(self._expression.switch(index, self._environment(phi) | {"omega": (omega, 0.0)}))

    def speed_law(self, phi: Floats, way_slope: Floats | None) -> SpeedLaw:
        """The torque at ``phi`` by the speed, of an operation that follows it; parameters as in ``lossless``."""
        environment, expression = self._environment(phi), self._expression
        if expression is None:
            raise AssertionError("only a formula follows the speed")
        efficiency = self._values.get("efficiency", np.ones(1))

        def law(omega: Floats) -> tuple[Floats, Floats]:
            found = expression.evaluate(environment | {"omega": (omega, np.ones(1))})
            value, by_speed = (self._turned(self._in_strokes(np.asarray(part), phi), way_slope) for part in found)
            passed = np.where(value > 0.0, efficiency, 1.0 / efficiency)
            return value * passed, by_speed * passed

        return law

    def _in_strokes(self, diagram: Floats, phi: Floats) -> Floats:
        """A diagram over the stroke, 0 outside the strokes in which it holds."""
        choice, stroke = self._choice, self._stroke
        if choice.over == "angle" or stroke is None:
            return diagram
        acts = np.zeros(np.shape(phi), dtype=np.bool_)
        if choice.during != "return":
            acts = acts | stroke.forward(phi)
        if choice.during != "forward":
            acts = acts | stroke.backward(phi)
        return np.where(acts, diagram, 0.0)

    def _turned(self, diagram: Floats, way_slope: Floats | None) -> Floats:
        """Torque on the shaft of a diagram of torque or force."""
        scale = self._values["scale"]
        if self._choice.quantity == "torque":
            return np.asarray(-scale * diagram)
        if way_slope is None:
            raise AssertionError("a force needs a mechanism")
        against = np.abs(way_slope) if self._choice.sense == "resisting" else way_slope
        return np.asarray(-scale * diagram * against)

    def _diagram(self, phi: Floats) -> Floats:
        """Value of the torque or force diagram at ``phi``."""
        choice, stroke = self._choice, self._stroke if self._choice.over == "stroke" else None
        place = phi if stroke is None else stroke.fraction(phi)
        if choice.form == "constant":
            diagram = self._values["value"] + 0.0 * phi
        elif self._curve is not None:
            diagram = self._curve(place)
        elif self._expression is not None:
            diagram = np.asarray(self._expression.evaluate(self._environment(phi))[0])
        else:
            diagram = self._steps(place, wraps=stroke is None)
        return self._in_strokes(np.asarray(diagram), phi)

    def _steps(self, place: Floats, *, wraps: bool) -> Floats:
        total: Floats = 0.0 * place
        for k in range(self._choice.steps):
            first, last, value = (self._values[f"steps.{k}.{name}"] for name in ("from", "to", "value"))
            if wraps:
                whole = last - first >= self._cycle
                width = np.where(whole, self._cycle, np.mod(last - first, self._cycle))
                inside = np.mod(place - first, self._cycle) < width
            else:
                # Near its end the stroke is so flat that its fraction rounds to 1.
                inside = (place >= first) & ((place < last) | (last >= 1.0))
            total = total + np.where(inside, value, 0.0)
        return total

    def torque(self, phi: Floats, way_slope: Floats | None) -> Floats:
        """Reduced torque M_r of the operation in N*m, negative where it resists, with the losses of its power.

        The parameters are those of ``lossless``.
        """
        torque = self.lossless(phi, way_slope)
        if not self.loses:
            return torque
        efficiency = self._values["efficiency"]
        return np.where(torque > 0.0, torque * efficiency, torque / efficiency)

    def lossless(self, phi: Floats, way_slope: Floats | None) -> Floats:
        """Reduced torque of the operation in N*m, negative where it resists, if nothing is lost.

        Parameters
        ----------
        phi : array
            Angles in rad, not at a jump.
        way_slope : array
            dx/dphi of the working part there, in m/rad; None where there is no mechanism.
        """
        choice = self._choice
        if choice.quantity == "none":
            return 0.0 * phi
        if choice.quantity in {"torque", "force"}:
            return self._turned(self._diagram(phi), way_slope)
        scale = self._values["scale"]
        if way_slope is None or self._stroke is None:
            raise AssertionError("a gas needs a mechanism")
        if choice.quantity == "gas":
            return np.asarray(scale * self._gas(phi, self._stroke) * way_slope)
        v = self._values
        force = (self._pressure(phi, self._stroke) - v["indicator.back_pressure"]) * v["indicator.piston_area"]
        return np.asarray(scale * force * way_slope)

    def push(self, phi: Floats, way_slope: Floats, omega: Floats | None) -> Floats:
        """Force on the working part along its forward stroke in N, if nothing is lost; 0 for a torque on the shaft."""
        choice, v = self._choice, self._values
        if choice.quantity in {"none", "torque"} or self._stroke is None:
            return 0.0 * phi
        if choice.quantity == "gas":
            return np.asarray(v["scale"] * self._gas(phi, self._stroke))
        if choice.quantity == "pressure":
            excess = self._pressure(phi, self._stroke) - v["indicator.back_pressure"]
            return np.asarray(v["scale"] * excess * v["indicator.piston_area"])
        if omega is None or not self.follows_speed or self._expression is None:
            diagram = self._diagram(phi)
        else:
            environment = self._environment(phi) | {"omega": (omega, 0.0)}
            diagram = self._in_strokes(np.asarray(self._expression.evaluate(environment)[0]), phi)
        against = np.sign(way_slope) if choice.sense == "resisting" else np.ones(1)
        return np.asarray(-v["scale"] * diagram * against)

    def _pressure(self, phi: Floats, stroke: Stroke) -> Floats:
        """Pressure on the piston in Pa; the strokes of a cycle are counted from the start of the first forward one."""
        if self._curve is not None:
            return self._curve(phi)
        x, forward = stroke.fraction(phi), stroke.forward(phi)
        turn = np.floor(np.mod(phi - stroke.start, self._cycle) / _TURN)
        pressure: Floats = 0.0 * x
        for index, curve in enumerate(self._strokes):
            pressure = np.where((turn == index // 2) & (forward == (index % 2 == 0)), curve(x), pressure)
        return pressure

    def _gas(self, phi: Floats, stroke: Stroke) -> Floats:
        """Force on the piston towards the forward stroke, in N; the cylinder's head is where that stroke starts."""
        v = self._values
        low, clearance, n = (v[f"gas.{name}"] for name in ("suction_pressure", "clearance", "exponent"))
        high = self._delivered()
        x = stroke.fraction(phi)
        # Without clearance the pressure at the head is 0/0; the other bound applies there.
        with np.errstate(divide="ignore", invalid="ignore"):
            expanding = np.fmax(low, high * elementary.power(clearance / (clearance + x), n))
            compressing = np.fmin(high, low * elementary.power((1.0 + clearance) / (clearance + x), n))
        pressure = np.where(stroke.forward(phi), expanding, compressing)
        return np.asarray((pressure - v["gas.back_pressure"]) * v["gas.piston_area"])

    def _delivered(self) -> Floats:
        """Highest pressure in the cylinder, in Pa: the discharge pressure where the compressor reaches it.

        Otherwise the valves stay closed, and the compressed gas expands along the same curve. Below the suction
        pressure the gas flows through without work.
        """
        v = self._values
        low, high = v["gas.suction_pressure"], v["gas.discharge_pressure"]
        return np.minimum(np.maximum(high, low), reachable_pressure(low, v["gas.clearance"], v["gas.exponent"]))

    @property
    def expression(self) -> Expression | None:
        """The formula of its diagram, if any."""
        return None if self._choice.quantity in {"none", "gas"} else self._expression

    def given_breaks(self) -> list[Floats]:
        """Those of ``breaks`` that are numbers of a step or of a table, or follow from them through the stroke."""
        return list(self.breaks) if self._strokes or self._curve is not None or self._choice.form == "steps" else []

    @cached_property
    def breaks(self) -> Sequence[Floats]:
        """Angles at which the torque jumps or has a kink, arrays of shape (cases or 1, n); NaN is none."""
        choice, values = self._choice, self._values
        if choice.quantity == "none":
            return []
        if choice.quantity == "gas" and self._stroke is not None:
            return self._gas_breaks(self._stroke)
        if self._strokes and self._stroke is not None:
            return [
                np.mod(
                    self._stroke.angles(curve.knots[None, None, :], forward=index % 2 == 0) + _TURN * (index // 2),
                    self._cycle,
                )[:, 0, :]
                for index, curve in enumerate(self._strokes)
            ]
        if choice.form == "formula" and self._expression is not None:
            return formula_breaks(self._expression, self._environment, self._revolutions)
        if choice.form == "steps":
            names = [f"steps.{k}.{end}" for k in range(choice.steps) for end in ("from", "to")]
            places = [values[name] for name in names]
        elif self._curve is not None:
            places = [self._curve.knots[None, None, :]]
        else:
            return []
        if choice.over == "angle":
            return [np.mod(place[:, 0, :], self._cycle) for place in places]
        if self._stroke is None:
            return []
        sides = {"forward": (True,), "return": (False,), "both": (True, False)}[choice.during]
        stroke = self._stroke
        angles = [stroke.angles(place, forward=side) for place in places for side in sides]
        return [every_revolution(angle, self._revolutions) for angle in angles]

    def _gas_breaks(self, stroke: Stroke) -> list[Floats]:
        v = self._values
        clearance = v["gas.clearance"]
        ratio = elementary.power(self._delivered() / v["gas.suction_pressure"], 1.0 / v["gas.exponent"])
        opens_suction = stroke.angles(clearance * (ratio - 1.0), forward=True)
        opens_discharge = stroke.angles((1.0 + clearance) / ratio - clearance, forward=False)
        return [every_revolution(angle, self._revolutions) for angle in (opens_suction, opens_discharge)]
