"""Specs written in Python.

Made of the descriptions of the spec by ``python -m tests.service.client.generate``; do not edit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypedDict

from sprag_study.service.client.drafts import Quantity, known
from sprag_study.service.client.machines.studies import Studies


class ShaftDriveMotor(TypedDict, total=False):
    """A motor whose torque depends on its speed."""

    kind: Literal["linear", "kloss", "table"]
    no_load_speed: Quantity
    stall_torque: Quantity
    inertia: Quantity
    synchronous_speed: Quantity
    breakdown_torque: Quantity
    breakdown_slip: Quantity
    scale: Quantity
    table: Sequence[Sequence[Quantity]]
    csv: str
    interpolation: Literal["smooth", "linear"]


class ShaftDriveStage(TypedDict, total=False):
    """Fields of stage."""

    kind: Literal["gear", "belt", "chain", "worm", "screw_nut", "rack"]
    ratio: Quantity
    efficiency: Quantity
    output_inertia: Quantity
    inertia: Quantity
    mass: Quantity
    radius: Quantity
    lead: Quantity


class ShaftDriveFlywheel(TypedDict, total=False):
    """A flywheel on the main shaft, given by its dimensions."""

    kind: Literal["rim", "disc"]
    diameter: Quantity
    mass: Quantity
    density: Quantity
    poisson_ratio: Quantity
    allowed_stress: Quantity


class ShaftDrive(TypedDict, total=False):
    """What turns the shaft."""

    inertia: Quantity
    torque: Quantity
    scale: Quantity
    motor: ShaftDriveMotor
    stages: Sequence[ShaftDriveStage]
    flywheel: ShaftDriveFlywheel


class ShaftMechanismSliderCrank(TypedDict, total=False):
    """Fields of slider_crank."""

    weights: Literal["ram", "all"]
    bodies: Literal["full", "two_mass"]
    crank: Quantity
    rod: Quantity
    offset: Quantity
    rod_centre: Quantity
    rod_mass: Quantity
    rod_inertia: Quantity
    ram_mass: Quantity
    inclination: Quantity


class ShaftMechanismFourBar(TypedDict, total=False):
    """Fields of four_bar."""

    weights: Literal["ram", "all"]
    bodies: Literal["full", "two_mass"]
    frame: Quantity
    crank: Quantity
    coupler: Quantity
    rocker: Quantity
    coupler_centre: Quantity
    coupler_mass: Quantity
    coupler_inertia: Quantity
    rocker_inertia: Quantity
    tray_mass: Quantity
    inclination: Quantity


class ShaftMechanismDragLink(TypedDict, total=False):
    """Fields of drag_link."""

    weights: Literal["ram", "all"]
    bodies: Literal["full", "two_mass"]
    frame: Quantity
    frame_angle: Quantity
    crank: Quantity
    coupler: Quantity
    coupler_centre: Quantity
    coupler_mass: Quantity
    coupler_inertia: Quantity
    follower: Quantity
    arm: Quantity
    arm_angle: Quantity
    follower_inertia: Quantity
    rod: Quantity
    offset: Quantity
    rod_centre: Quantity
    rod_mass: Quantity
    rod_inertia: Quantity
    ram_mass: Quantity
    inclination: Quantity


class ShaftMechanismToggle(TypedDict, total=False):
    """Fields of toggle."""

    weights: Literal["ram", "all"]
    bodies: Literal["full", "two_mass"]
    frame: Quantity
    crank: Quantity
    coupler: Quantity
    coupler_centre: Quantity
    coupler_mass: Quantity
    coupler_inertia: Quantity
    rocker: Quantity
    line_angle: Quantity
    rocker_inertia: Quantity
    rod: Quantity
    rod_centre: Quantity
    rod_mass: Quantity
    rod_inertia: Quantity
    ram_mass: Quantity
    inclination: Quantity


class ShaftMechanismScotchYoke(TypedDict, total=False):
    """Fields of scotch_yoke."""

    crank: Quantity
    yoke_mass: Quantity
    block_mass: Quantity
    inclination: Quantity


class ShaftMechanismParallelCrank(TypedDict, total=False):
    """Fields of parallel_crank."""

    crank: Quantity
    coupler_mass: Quantity
    driven_inertia: Quantity
    inclination: Quantity


class ShaftMechanismQuickReturn(TypedDict, total=False):
    """Fields of quick_return."""

    kind: Literal["crank_shaper", "whitworth"]
    weights: Literal["ram", "all"]
    bodies: Literal["full", "two_mass"]
    crank: Quantity
    pivot_distance: Quantity
    link_arm: Quantity
    rod: Quantity
    offset: Quantity
    rod_centre: Quantity
    rod_mass: Quantity
    rod_inertia: Quantity
    ram_mass: Quantity
    inclination: Quantity
    link_inertia: Quantity
    block_mass: Quantity


class ShaftMechanismCam(TypedDict, total=False):
    """Fields of cam."""

    rise: Literal["cycloidal", "polynomial_345"]
    fall: Literal["cycloidal", "polynomial_345"]
    lift: Quantity
    start: Quantity
    rise_angle: Quantity
    dwell_angle: Quantity
    fall_angle: Quantity
    follower_mass: Quantity
    spring_rate: Quantity
    spring_preload: Quantity
    inclination: Quantity


class ShaftMechanism(TypedDict, total=False):
    """What the shaft drives: a table, a formula, or dimensions and masses."""

    table: Sequence[Sequence[Quantity]]
    csv: str
    formula: str
    slider_crank: ShaftMechanismSliderCrank
    four_bar: ShaftMechanismFourBar
    drag_link: ShaftMechanismDragLink
    toggle: ShaftMechanismToggle
    scotch_yoke: ShaftMechanismScotchYoke
    parallel_crank: ShaftMechanismParallelCrank
    quick_return: ShaftMechanismQuickReturn
    cam: ShaftMechanismCam
    interpolation: Literal["smooth", "linear"]


class ShaftOperationGas(TypedDict, total=False):
    """A gas drawn in and compressed by the working part."""

    piston_area: Quantity
    suction_pressure: Quantity
    discharge_pressure: Quantity
    back_pressure: Quantity
    clearance: Quantity
    exponent: Quantity


class ShaftOperationIndicator(TypedDict, total=False):
    """The pressure on the piston as measured."""

    over: Literal["angle", "stroke", "time"]
    recorded_at: Quantity
    table: Sequence[Sequence[Quantity]]
    csv: str
    interpolation: Literal["smooth", "linear"]
    piston_area: Quantity
    back_pressure: Quantity


class ShaftOperation(TypedDict, total=False):
    """What resists."""

    value: Quantity
    steps: Sequence[Mapping[str, Any]]
    table: Sequence[Sequence[Quantity]]
    csv: str
    formula: str
    gas: ShaftOperationGas
    indicator: ShaftOperationIndicator
    quantity: Literal["force", "torque"]
    over: Literal["angle", "stroke", "time"]
    during: Literal["forward", "return", "both"]
    sense: Literal["resisting", "fixed"]
    interpolation: Literal["smooth", "linear"]
    scale: Quantity
    efficiency: Quantity
    recorded_at: Quantity


class ShaftPart(TypedDict, total=False):
    """A mechanism with its operation; their angle is that of the shaft plus the crank angle."""

    crank_angle: Quantity
    mechanism: ShaftMechanism
    operation: ShaftOperation


class Shaft(Studies):
    """A study of the model machine-shaft, to be varied and run."""

    _model = "machine-shaft"
    _parameters = (
        "mean_speed",
        "drive.inertia",
        "drive.torque",
        "drive.scale",
        "drive.motor.no_load_speed",
        "drive.motor.stall_torque",
        "drive.motor.inertia",
        "drive.motor.synchronous_speed",
        "drive.motor.breakdown_torque",
        "drive.motor.breakdown_slip",
        "drive.motor.scale",
        "drive.stages.*.ratio",
        "drive.stages.*.efficiency",
        "drive.stages.*.output_inertia",
        "drive.stages.*.inertia",
        "drive.stages.*.mass",
        "drive.stages.*.radius",
        "drive.stages.*.lead",
        "drive.flywheel.diameter",
        "drive.flywheel.mass",
        "drive.flywheel.density",
        "drive.flywheel.poisson_ratio",
        "drive.flywheel.allowed_stress",
        "mechanism.slider_crank.crank",
        "mechanism.slider_crank.rod",
        "mechanism.slider_crank.offset",
        "mechanism.slider_crank.rod_centre",
        "mechanism.slider_crank.rod_mass",
        "mechanism.slider_crank.rod_inertia",
        "mechanism.slider_crank.ram_mass",
        "mechanism.slider_crank.inclination",
        "mechanism.four_bar.frame",
        "mechanism.four_bar.crank",
        "mechanism.four_bar.coupler",
        "mechanism.four_bar.rocker",
        "mechanism.four_bar.coupler_centre",
        "mechanism.four_bar.coupler_mass",
        "mechanism.four_bar.coupler_inertia",
        "mechanism.four_bar.rocker_inertia",
        "mechanism.four_bar.tray_mass",
        "mechanism.four_bar.inclination",
        "mechanism.drag_link.frame",
        "mechanism.drag_link.frame_angle",
        "mechanism.drag_link.crank",
        "mechanism.drag_link.coupler",
        "mechanism.drag_link.coupler_centre",
        "mechanism.drag_link.coupler_mass",
        "mechanism.drag_link.coupler_inertia",
        "mechanism.drag_link.follower",
        "mechanism.drag_link.arm",
        "mechanism.drag_link.arm_angle",
        "mechanism.drag_link.follower_inertia",
        "mechanism.drag_link.rod",
        "mechanism.drag_link.offset",
        "mechanism.drag_link.rod_centre",
        "mechanism.drag_link.rod_mass",
        "mechanism.drag_link.rod_inertia",
        "mechanism.drag_link.ram_mass",
        "mechanism.drag_link.inclination",
        "mechanism.toggle.frame",
        "mechanism.toggle.crank",
        "mechanism.toggle.coupler",
        "mechanism.toggle.coupler_centre",
        "mechanism.toggle.coupler_mass",
        "mechanism.toggle.coupler_inertia",
        "mechanism.toggle.rocker",
        "mechanism.toggle.line_angle",
        "mechanism.toggle.rocker_inertia",
        "mechanism.toggle.rod",
        "mechanism.toggle.rod_centre",
        "mechanism.toggle.rod_mass",
        "mechanism.toggle.rod_inertia",
        "mechanism.toggle.ram_mass",
        "mechanism.toggle.inclination",
        "mechanism.scotch_yoke.crank",
        "mechanism.scotch_yoke.yoke_mass",
        "mechanism.scotch_yoke.block_mass",
        "mechanism.scotch_yoke.inclination",
        "mechanism.parallel_crank.crank",
        "mechanism.parallel_crank.coupler_mass",
        "mechanism.parallel_crank.driven_inertia",
        "mechanism.parallel_crank.inclination",
        "mechanism.quick_return.crank",
        "mechanism.quick_return.pivot_distance",
        "mechanism.quick_return.link_arm",
        "mechanism.quick_return.rod",
        "mechanism.quick_return.offset",
        "mechanism.quick_return.rod_centre",
        "mechanism.quick_return.rod_mass",
        "mechanism.quick_return.rod_inertia",
        "mechanism.quick_return.ram_mass",
        "mechanism.quick_return.inclination",
        "mechanism.quick_return.link_inertia",
        "mechanism.quick_return.block_mass",
        "mechanism.cam.lift",
        "mechanism.cam.start",
        "mechanism.cam.rise_angle",
        "mechanism.cam.dwell_angle",
        "mechanism.cam.fall_angle",
        "mechanism.cam.follower_mass",
        "mechanism.cam.spring_rate",
        "mechanism.cam.spring_preload",
        "mechanism.cam.inclination",
        "operation.value",
        "operation.steps.*.from",
        "operation.steps.*.to",
        "operation.steps.*.value",
        "operation.gas.piston_area",
        "operation.gas.suction_pressure",
        "operation.gas.discharge_pressure",
        "operation.gas.back_pressure",
        "operation.gas.clearance",
        "operation.gas.exponent",
        "operation.indicator.recorded_at",
        "operation.indicator.piston_area",
        "operation.indicator.back_pressure",
        "operation.scale",
        "operation.efficiency",
        "operation.recorded_at",
        "parts.*.crank_angle",
        "parts.*.mechanism.slider_crank.crank",
        "parts.*.mechanism.slider_crank.rod",
        "parts.*.mechanism.slider_crank.offset",
        "parts.*.mechanism.slider_crank.rod_centre",
        "parts.*.mechanism.slider_crank.rod_mass",
        "parts.*.mechanism.slider_crank.rod_inertia",
        "parts.*.mechanism.slider_crank.ram_mass",
        "parts.*.mechanism.slider_crank.inclination",
        "parts.*.mechanism.four_bar.frame",
        "parts.*.mechanism.four_bar.crank",
        "parts.*.mechanism.four_bar.coupler",
        "parts.*.mechanism.four_bar.rocker",
        "parts.*.mechanism.four_bar.coupler_centre",
        "parts.*.mechanism.four_bar.coupler_mass",
        "parts.*.mechanism.four_bar.coupler_inertia",
        "parts.*.mechanism.four_bar.rocker_inertia",
        "parts.*.mechanism.four_bar.tray_mass",
        "parts.*.mechanism.four_bar.inclination",
        "parts.*.mechanism.drag_link.frame",
        "parts.*.mechanism.drag_link.frame_angle",
        "parts.*.mechanism.drag_link.crank",
        "parts.*.mechanism.drag_link.coupler",
        "parts.*.mechanism.drag_link.coupler_centre",
        "parts.*.mechanism.drag_link.coupler_mass",
        "parts.*.mechanism.drag_link.coupler_inertia",
        "parts.*.mechanism.drag_link.follower",
        "parts.*.mechanism.drag_link.arm",
        "parts.*.mechanism.drag_link.arm_angle",
        "parts.*.mechanism.drag_link.follower_inertia",
        "parts.*.mechanism.drag_link.rod",
        "parts.*.mechanism.drag_link.offset",
        "parts.*.mechanism.drag_link.rod_centre",
        "parts.*.mechanism.drag_link.rod_mass",
        "parts.*.mechanism.drag_link.rod_inertia",
        "parts.*.mechanism.drag_link.ram_mass",
        "parts.*.mechanism.drag_link.inclination",
        "parts.*.mechanism.toggle.frame",
        "parts.*.mechanism.toggle.crank",
        "parts.*.mechanism.toggle.coupler",
        "parts.*.mechanism.toggle.coupler_centre",
        "parts.*.mechanism.toggle.coupler_mass",
        "parts.*.mechanism.toggle.coupler_inertia",
        "parts.*.mechanism.toggle.rocker",
        "parts.*.mechanism.toggle.line_angle",
        "parts.*.mechanism.toggle.rocker_inertia",
        "parts.*.mechanism.toggle.rod",
        "parts.*.mechanism.toggle.rod_centre",
        "parts.*.mechanism.toggle.rod_mass",
        "parts.*.mechanism.toggle.rod_inertia",
        "parts.*.mechanism.toggle.ram_mass",
        "parts.*.mechanism.toggle.inclination",
        "parts.*.mechanism.scotch_yoke.crank",
        "parts.*.mechanism.scotch_yoke.yoke_mass",
        "parts.*.mechanism.scotch_yoke.block_mass",
        "parts.*.mechanism.scotch_yoke.inclination",
        "parts.*.mechanism.parallel_crank.crank",
        "parts.*.mechanism.parallel_crank.coupler_mass",
        "parts.*.mechanism.parallel_crank.driven_inertia",
        "parts.*.mechanism.parallel_crank.inclination",
        "parts.*.mechanism.quick_return.crank",
        "parts.*.mechanism.quick_return.pivot_distance",
        "parts.*.mechanism.quick_return.link_arm",
        "parts.*.mechanism.quick_return.rod",
        "parts.*.mechanism.quick_return.offset",
        "parts.*.mechanism.quick_return.rod_centre",
        "parts.*.mechanism.quick_return.rod_mass",
        "parts.*.mechanism.quick_return.rod_inertia",
        "parts.*.mechanism.quick_return.ram_mass",
        "parts.*.mechanism.quick_return.inclination",
        "parts.*.mechanism.quick_return.link_inertia",
        "parts.*.mechanism.quick_return.block_mass",
        "parts.*.mechanism.cam.lift",
        "parts.*.mechanism.cam.start",
        "parts.*.mechanism.cam.rise_angle",
        "parts.*.mechanism.cam.dwell_angle",
        "parts.*.mechanism.cam.fall_angle",
        "parts.*.mechanism.cam.follower_mass",
        "parts.*.mechanism.cam.spring_rate",
        "parts.*.mechanism.cam.spring_preload",
        "parts.*.mechanism.cam.inclination",
        "parts.*.operation.value",
        "parts.*.operation.steps.*.from",
        "parts.*.operation.steps.*.to",
        "parts.*.operation.steps.*.value",
        "parts.*.operation.gas.piston_area",
        "parts.*.operation.gas.suction_pressure",
        "parts.*.operation.gas.discharge_pressure",
        "parts.*.operation.gas.back_pressure",
        "parts.*.operation.gas.clearance",
        "parts.*.operation.gas.exponent",
        "parts.*.operation.indicator.recorded_at",
        "parts.*.operation.indicator.piston_area",
        "parts.*.operation.indicator.back_pressure",
        "parts.*.operation.scale",
        "parts.*.operation.efficiency",
        "parts.*.operation.recorded_at",
        "wanted_irregularity",
        "friction_torque",
        "gravity",
    )

    def __init__(
        self,
        *,
        drive: ShaftDrive,
        cycle: Any | None = None,
        mean_speed: Quantity | None = None,
        mean_speed_is: Literal["midrange", "angle", "time"] | None = None,
        mechanism: ShaftMechanism | None = None,
        operation: ShaftOperation | None = None,
        parts: Sequence[ShaftPart] | None = None,
        balance: Literal["constant", "scale", "refuse", "motor"] | None = None,
        balance_side: Literal["drive", "operation"] | None = None,
        phi_c: int | None = None,
        constants: Mapping[str, Any] | None = None,
        wanted_irregularity: Quantity | None = None,
        friction_torque: Quantity | None = None,
        gravity: Quantity | None = None,
        name: str | None = None,
        run: Mapping[str, Any] | None = None,
        derive: Mapping[str, Any] | None = None,
    ) -> None:
        """A study of the model 'machine-shaft': the machine that every case begins from.

        Parameters
        ----------
        drive : values
            What turns the shaft.
        cycle : values, optional
            Revolutions of a cycle, 1 to 12.
        mean_speed : number or text with a unit, optional
            Required mean speed of the shaft (w_m), rad/s; > 0 rad/s and <= 1e+06 rad/s.
        mean_speed_is : values, optional
            Which mean of the speed the given mean speed and the irregularity refer to.
        mechanism : values, optional
            What the shaft drives: a table, a formula, or dimensions and masses.
        operation : values, optional
            What resists.
        parts : values, optional
            Several mechanisms on the shaft, each with its operation and at its crank angle.
        balance : values, optional
            What makes the work over a cycle zero; by default constant, refuse where a torque is given, motor where
            there is one.
        balance_side : values, optional
            Which torque the balance makes constant or scales.
        phi_c : int, optional
            Which of the angles with T = T_mean S3 and S4 count from, from 0; by default the first where T rises.
        constants : values, optional
            Numbers that formulas use by their names.
        wanted_irregularity : number or text with a unit, optional
            Irregularity that determines the required inertia (delta), 1; > 0 and <= 2.
        friction_torque : number or text with a unit, optional
            Friction of the shaft, always resisting (M_f), N*m; >= 0 N*m and <= 1e+12 N*m.
        gravity : number or text with a unit, optional
            Gravitational acceleration (g), m/s^2; >= 0 m/s^2 and <= 1000 m/s^2.
        name : str, optional
            Name of the study.
        run : values, optional
            Nothing: a machine shaft is solved for its whole cycle.
        derive : values, optional
            Parameters that follow from others in every case, by path: formulas of other parameters, of numbers with
            their units and of functions; `*` stands for every pendulum or step.
        """
        super().__init__(
            base=known(
                cycle=cycle,
                mean_speed=mean_speed,
                mean_speed_is=mean_speed_is,
                drive=drive,
                mechanism=mechanism,
                operation=operation,
                parts=parts,
                balance=balance,
                balance_side=balance_side,
                phi_c=phi_c,
                constants=constants,
                wanted_irregularity=wanted_irregularity,
                friction_torque=friction_torque,
                gravity=gravity,
            ),
            name=name,
            run=run,
            derive=derive,
        )
