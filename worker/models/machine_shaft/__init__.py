"""The model of machine shafts: a drive turns a shaft steadily against mechanisms and their resistance."""

from sprag_study.engine.formulas.expressions import ExpressionError
from sprag_study.engine.machine_shaft.problems import RelationError
from sprag_study.engine.machine_shaft.sketch import Sketch
from sprag_study.engine.machine_shaft.spec import LINKED, MAX_CONSTANTS, MAX_PARTS, MAX_STAGES, MAX_STEPS, REVOLUTIONS
from sprag_study.engine.machine_shaft.tables import MAX_ROWS
from sprag_study.engine.problems import MachineError
from sprag_study.worker.models.machine_shaft.model import (
    MODEL,
    REMARKS,
    SHAPE,
    STAGE_KINDS,
    MachineShaft,
    base_results,
    check,
    check_structure,
    parameters_of,
    reachable_pressure,
    sketches_of,
    spec_of,
)

__all__ = [
    "LINKED",
    "MAX_CONSTANTS",
    "MAX_PARTS",
    "MAX_ROWS",
    "MAX_STAGES",
    "MAX_STEPS",
    "MODEL",
    "REMARKS",
    "REVOLUTIONS",
    "SHAPE",
    "STAGE_KINDS",
    "ExpressionError",
    "MachineError",
    "MachineShaft",
    "RelationError",
    "Sketch",
    "base_results",
    "check",
    "check_structure",
    "parameters_of",
    "reachable_pressure",
    "sketches_of",
    "spec_of",
]
