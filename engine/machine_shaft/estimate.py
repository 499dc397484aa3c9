"""Estimated time of a case from the structure of its machine (measured by benchmarks/machine_shaft.py)."""

from sprag_study.engine.formulas.expressions import TIME, Expression, Node, names_of
from sprag_study.engine.machine_shaft.simulate import PANELS
from sprag_study.engine.machine_shaft.spec import MachineSpec

#: Measured times of a case relative to that with the midrange as mean.
_COST = {"midrange": 1.0, "angle": 2.2, "time": 1.7}
#: Additional time of a formula: shared by all cases, with constants, and with jumps or kinks.
_FORMULA, _OWN, _SWITCHES = 0.1, 0.7, 1.0
#: Additional time of a formula that may have a narrow peak. Measured: 2 for a width of 1 rad, 10 for 0.1 rad, 27 for
#: 0.01 rad, 48 for 0.001 rad.
_PEAK = 12.0
#: Additional time of each part beyond the first.
_PART = 0.2
#: Additional time of each group of a linkage, for its motion, its limits and its reversals.
_GROUP = 7.0
#: Additional time of a formula that follows the speed, which is then iterated.
_SPEED = 12.0
#: Time with loads over that without.
_LOADS = 1.4
#: Additional seconds of a case with couplings. Measured: 1e-3 with a smooth load, 6e-3 with a sudden one.
_COUPLED = 4e-3
_SHARP = frozenset({"exp", "tanh", "sinh", "cosh", "atan"})


def estimate_seconds(model: MachineSpec, *, with_loads: bool = False) -> float:
    """Rough time of one case on one core, in s; ``with_loads`` with the loads among its results."""
    every = [part for _, part in model.every_part()]
    parts = [model.drive, *(own for part in every for own in (part.mechanism, part.operation))]
    panels = PANELS * model.cycle + sum(len(part.table.rows) for part in parts if part.table is not None)
    # Dead centres and kinks of each further part are cuts.
    panels += 2 * sum(part.turns_in(model.cycle) for part in every[1:])
    factor = 8.0 if model.balance == "motor" else _COST[model.mean_speed_is]
    factor += sum(_formula_cost(part.formula, model.constants) for part in parts if part.formula is not None)
    factor += _PART * (len(every) - 1)
    elements = (each for part in every if part.mechanism.linkage for each in part.mechanism.linkage.elements)
    factor += _GROUP * sum(each.kind not in {"pivot", "point"} for each in elements)
    if with_loads:
        factor *= _LOADS
    return 1e-5 + factor * 7e-6 * panels + (_COUPLED if "coupling" in model.drive.stages else 0.0)


def _formula_cost(text: str, constants: tuple[str, ...]) -> float:
    expression = Expression(text, dict.fromkeys(("phi", "x", "omega", TIME, *constants)))
    cost = _FORMULA + (_SPEED if "omega" in expression.used - set(constants) else 0.0)
    if expression.used & set(constants):
        cost += _OWN
    if expression.switch_count:
        cost += _SWITCHES
    if expression.kinds & _SHARP or _divides_by_angle(expression.root):
        cost += _PEAK
    return cost


def _divides_by_angle(node: Node) -> bool:
    """Whether the formula has a divisor that changes over the cycle, such as 1/(1 + (phi/w)^2)."""
    if node.kind == "/" and names_of(node.parts[1]) & {"phi", "x", TIME}:
        return True
    return any(map(_divides_by_angle, node.parts))
