"""Studies that find the parameters of a measured machine (docs/calibration.md)."""

from sprag_study.worker.planning.calibrate.plan import CalibratePlan, Measured, Sensor, Unknown
from sprag_study.worker.planning.calibrate.planner import CalibratePlanner

__all__ = ["CalibratePlan", "CalibratePlanner", "Measured", "Sensor", "Unknown"]
