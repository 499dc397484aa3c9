"""What is asked of a transient and what it gives; `sprag_study.worker.models.abilities` runs it."""

from sprag_study.engine.machine_shaft.transient_course import KINDS, RESULTS, Course, Kind, Outcome, Transient

__all__ = ["KINDS", "RESULTS", "Course", "Kind", "Outcome", "Transient"]
