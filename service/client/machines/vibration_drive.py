"""Specs written in Python.

Made of the descriptions of the spec by ``python -m tests.service.client.generate``; do not edit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypedDict

from sprag_study.service.client.drafts import Quantity, known
from sprag_study.service.client.machines.studies import Studies


class DriveExcitation(TypedDict, total=False):
    """Fields of excitation."""

    frequency: Quantity
    amplitude_x: Quantity
    amplitude_y: Quantity
    phase: Quantity


class DrivePendulum(TypedDict, total=False):
    """Fields of pendulum."""

    inertia: Quantity
    mass: Quantity
    arm: Quantity
    spring_rate: Quantity
    spring_arm: Quantity
    damping: Quantity
    backlash: Quantity
    clutch_damping: Quantity
    overrunning_damping: Quantity
    initial_angle: Quantity
    initial_speed: Quantity
    initial_windup: Quantity
    initial_clutch: Quantity
    clutch: Any


class DriveShaft(TypedDict, total=False):
    """Fields of shaft."""

    inertia: Quantity
    load: Quantity
    bearing_damping: Quantity
    linear_load: Quantity
    quadratic_load: Quantity
    initial_speed: Quantity


class DriveStart(TypedDict, total=False):
    """Begin in the state in which a case of another study ends; the service replaces it by initial values."""

    study: str
    case: int
    start: int


class DriveRun(TypedDict, total=False):
    """How long each case runs, what is evaluated, how accurately."""

    until: Literal["settled"]
    at_most: str
    settled: Quantity
    max_period: int
    duration: Quantity
    window: Sequence[Quantity]
    tolerance: Quantity
    reset: Literal["contact", "literal"]


class Drive(Studies):
    """A study of the model vibration-drive, to be varied and run."""

    _model = "vibration-drive"
    _parameters = (
        "gravity",
        "excitation.frequency",
        "excitation.amplitude_x",
        "excitation.amplitude_y",
        "excitation.phase",
        "pendulums.*.inertia",
        "pendulums.*.mass",
        "pendulums.*.arm",
        "pendulums.*.spring_rate",
        "pendulums.*.spring_arm",
        "pendulums.*.damping",
        "pendulums.*.backlash",
        "pendulums.*.clutch_damping",
        "pendulums.*.overrunning_damping",
        "pendulums.*.initial_angle",
        "pendulums.*.initial_speed",
        "pendulums.*.initial_windup",
        "pendulums.*.initial_clutch",
        "pendulums.*.clutch.windup_limit",
        "pendulums.*.clutch.accuracy",
        "shaft.inertia",
        "shaft.load",
        "shaft.bearing_damping",
        "shaft.linear_load",
        "shaft.quadratic_load",
        "shaft.initial_speed",
        "clutch.windup_limit",
        "clutch.accuracy",
    )

    def __init__(
        self,
        *,
        excitation: DriveExcitation,
        pendulums: Sequence[DrivePendulum],
        shaft: DriveShaft,
        gravity: Quantity | None = None,
        clutch: Any | None = None,
        start: DriveStart | None = None,
        name: str | None = None,
        run: DriveRun | None = None,
        derive: Mapping[str, Any] | None = None,
    ) -> None:
        """A study of the model 'vibration-drive': the machine that every case begins from.

        Parameters
        ----------
        excitation : values
        pendulums : values
        shaft : values
        gravity : number or text with a unit, optional
            Gravitational acceleration (g), m/s^2; >= 0 m/s^2 and <= 1000 m/s^2.
        clutch : values, optional
            Torque of the freewheel clutch over its windup.
        start : values, optional
            Begin in the state in which a case of another study ends; the service replaces it by initial values.
        name : str, optional
            Name of the study.
        run : values, optional
            How long each case runs, what is evaluated, how accurately.
        derive : values, optional
            Parameters that follow from others in every case, by path: formulas of other parameters, of numbers with
            their units and of functions; `*` stands for every pendulum or step.
        """
        super().__init__(
            base=known(
                gravity=gravity, excitation=excitation, pendulums=pendulums, shaft=shaft, clutch=clutch, start=start
            ),
            name=name,
            run=run,
            derive=derive,
        )
