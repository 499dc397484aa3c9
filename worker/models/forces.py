"""The forces of a case: what is known of the bearings of its shaft, and what is answered; `abilities` runs it."""

from sprag_study.engine.outcome import Forces
from sprag_study.engine.vibration_drive.force_results import Bearing, force_infos

__all__ = ["Bearing", "Forces", "force_infos"]
