"""Refusing a base machine that has no steady motion, with the reason."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.machine_shaft.columns import Columns
from sprag_study.engine.machine_shaft.machine import Machine, check_structure
from sprag_study.engine.machine_shaft.problems import (
    AssemblyError,
    InsufficientInertiaError,
    MotorOverrunError,
    MotorStalledError,
    NearSingularError,
    NegativeInertiaError,
    QuadratureError,
    UnbalancedWorkError,
)
from sprag_study.engine.machine_shaft.relations import check_relations
from sprag_study.engine.machine_shaft.results import result_infos
from sprag_study.engine.machine_shaft.simulate import simulate
from sprag_study.engine.machine_shaft.spec import MachineSpec
from sprag_study.engine.problems import MachineError

_NAMES = tuple(info.name for info in result_infos())


def check(model: MachineSpec, columns: Mapping[str, ArrayLike]) -> Ending:
    """Refuse a base machine without steady motion, with all available reasons.

    An unstable motion is allowed: the ending tells it.

    Parameters
    ----------
    model : MachineSpec
    columns : mapping
        As for ``simulate``, scalars only.

    Raises
    ------
    MachineError
        One of ``sprag_study.engine.machine_shaft.problems``.
    """
    check_structure(model)
    row = Columns.of(model, columns, 1)
    check_relations(model, row)
    batch = simulate(model, columns, cases=1)
    ending, result = ENDINGS[int(batch.endings[0])], dict(zip(_NAMES, batch.values[0], strict=True))
    if ending is not Ending.CANNOT_ASSEMBLE:
        machine = Machine(model, row)
        machine.check_finite()
        machine.check_closed()
    problem = _problem(model, ending, result, row)
    if problem is not None:
        raise problem
    return ending


def _problem(spec: MachineSpec, ending: Ending, result: Mapping[str, float], row: Columns) -> MachineError | None:
    if ending is Ending.CANNOT_ASSEMBLE:
        prefix, rule = Machine(spec, row).broken_rule()
        return AssemblyError(float(result["assembly.angle"]), rule, prefix)
    if ending is Ending.NEGATIVE_INERTIA:
        return NegativeInertiaError(float(result["inertia.min"]))
    if ending is Ending.UNBALANCED_WORK:
        works = float(result["work.drive"]), float(result["work.resistance"])
        friction = float(row.row("friction_torque")[0]) * 2.0 * np.pi * spec.cycle
        return UnbalancedWorkError(*works, spec.balance_side if spec.balance == "scale" else "", friction)
    if ending is Ending.INERTIA_INSUFFICIENT:
        return InsufficientInertiaError(float(row.row("mean_speed")[0]), float(result["least_mean_speed"]))
    plain = _PLAIN_PROBLEMS.get(ending)
    return None if plain is None else plain()


#: Problems without further information than the ending.
_PLAIN_PROBLEMS: dict[Ending, type[MotorStalledError | MotorOverrunError | NearSingularError | QuadratureError]] = {
    problem.ending: problem for problem in (MotorStalledError, MotorOverrunError, NearSingularError, QuadratureError)
}
