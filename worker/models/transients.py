"""What is asked of a transient and what it gives; `sprag.worker.models.abilities` runs it."""

from sprag.engine.machine_shaft.transient_course import KINDS, RESULTS, Course, Kind, Outcome, Transient

__all__ = ["KINDS", "RESULTS", "Course", "Kind", "Outcome", "Transient"]
