"""The model of machine shafts: a drive turns a shaft steadily against mechanisms and their resistance."""

from sprag_study.engine.formulas.expressions import ExpressionError
from sprag_study.engine.machine_shaft.elements import (
    BRANCHES,
    ELEMENT_KINDS,
    FRAME,
    MAX_ELEMENTS,
    SHAFT,
    LinkageChoice,
    element_faults,
)
from sprag_study.engine.machine_shaft.load_results import MAX_JOINTS
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
    joints_in,
    other_speed,
    parameters_of,
    reachable_pressure,
    sketches_of,
    spec_of,
)

__all__ = [
    "BRANCHES",
    "ELEMENT_KINDS",
    "FRAME",
    "LINKED",
    "MAX_CONSTANTS",
    "MAX_ELEMENTS",
    "MAX_JOINTS",
    "MAX_PARTS",
    "MAX_ROWS",
    "MAX_STAGES",
    "MAX_STEPS",
    "MODEL",
    "REMARKS",
    "REVOLUTIONS",
    "SHAFT",
    "SHAPE",
    "STAGE_KINDS",
    "ExpressionError",
    "LinkageChoice",
    "MachineError",
    "MachineShaft",
    "RelationError",
    "Sketch",
    "base_results",
    "check",
    "check_structure",
    "element_faults",
    "joints_in",
    "other_speed",
    "parameters_of",
    "reachable_pressure",
    "sketches_of",
    "spec_of",
]
