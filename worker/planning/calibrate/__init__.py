"""Studies that find the parameters of a measured machine (docs/calibration.md)."""

from sprag.worker.planning.calibrate.plan import CalibratePlan, Measured, Unknown
from sprag.worker.planning.calibrate.planner import CalibratePlanner

__all__ = ["CalibratePlan", "CalibratePlanner", "Measured", "Unknown"]
