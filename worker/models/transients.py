"""Transients of one case: whether its model has them, what is asked for, and the run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag.engine.machine_shaft.transient_course import KINDS, RESULTS, Course, Kind, Outcome, Transient
from sprag.worker.models.common import KernelShape
from sprag.worker.models.model import model_of

if TYPE_CHECKING:
    from sprag.worker.study import Study

__all__ = [
    "KINDS",
    "RESULTS",
    "Course",
    "Kind",
    "Outcome",
    "Transient",
    "has_motor",
    "has_transients",
    "run_transient",
    "shape_of_transients",
]


def has_transients(study: Study) -> bool:
    """Whether the machine of the study has transients."""
    return model_of(study.model).has_transients


def has_motor(study: Study) -> bool:
    """Whether a motor drives the machine of the study, whose torque follows the speed."""
    return (study.structure or {}).get("balance") == "motor"


def shape_of_transients(study: Study) -> KernelShape:
    """The kernel of transients, which is compiled apart from that of the cases."""
    return KernelShape(study.model, ("transient",))


def run_transient(study: Study, case: int, course: Course, points: int) -> Transient:
    """A transient of one case, with ``points`` equally spaced times; ValueError where its model has none."""
    return model_of(study.model).transient(study, case, course, points)
