"""What is asked of a start-up with ramps and what it gives; `sprag_study.worker.models.abilities` runs it."""

from sprag_study.engine.vibration_drive.ramps import MOST_PERIODS, Ramps, StartUp, start_up_infos

__all__ = ["MOST_PERIODS", "Ramps", "StartUp", "start_up_infos"]
