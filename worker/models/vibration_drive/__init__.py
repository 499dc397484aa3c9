"""The model of vibration drives: pendulums on a vibrating base that turn a shaft through freewheels."""

from sprag_study.worker.models.vibration_drive.model import (
    MODEL,
    NOT_SETTLED,
    WINDUP_OUT_OF_DATA,
    VibrationDrive,
    coefficients,
    duration_seconds,
    kernel_source,
    pendulums,
    run_of,
)

__all__ = [
    "MODEL",
    "NOT_SETTLED",
    "WINDUP_OUT_OF_DATA",
    "VibrationDrive",
    "coefficients",
    "duration_seconds",
    "kernel_source",
    "pendulums",
    "run_of",
]
