"""Specs written in Python.

Made of the descriptions of the spec by ``python -m tests.service.client.generate``; do not edit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypedDict

from sprag_study.service.client.drafts import Quantity, known
from sprag_study.service.client.machines.studies import Studies


class ShaftDriveMotor(TypedDict, total=False):
    """A motor whose torque depends on its speed.

    kind : Kind of the motor.
    no_load_speed : Speed at which its torque is 0 (w_0), rad/s; > 0 rad/s and <= 1e+06 rad/s.
    stall_torque : Its torque at rest (M_0), N*m; > 0 N*m and <= 1e+12 N*m.
    inertia : Inertia of its rotor (J_m), kg*m^2; >= 0 kg*m^2 and <= 1e+12 kg*m^2.
    rated_torque : Torque that it gives continuously (duty type S1), which determines its thermal margin (M_N), N*m; > 0
        N*m and <= 1e+12 N*m.
    synchronous_speed : Its synchronous speed (w_s), rad/s; > 0 rad/s and <= 1e+06 rad/s.
    breakdown_torque : Its largest torque (M_k), N*m; > 0 N*m and <= 1e+12 N*m.
    breakdown_slip : Slip at its largest torque (s_k); > 0 and <= 1000.
    scale : Factor on the torques of its table (k_m); > 0 and <= 1e+12.
    table : Rows of speed (rad/s) and torque (N*m).
    csv : Speed (rad/s) and torque (N*m) as the text of a CSV file, headings with units in brackets.
    interpolation : How rows of the table are joined: without overshoot, or by straight lines.
    """

    kind: Literal["linear", "kloss", "table"]
    no_load_speed: Quantity
    stall_torque: Quantity
    inertia: Quantity
    rated_torque: Quantity
    synchronous_speed: Quantity
    breakdown_torque: Quantity
    breakdown_slip: Quantity
    scale: Quantity
    table: Sequence[Sequence[Quantity]]
    csv: str
    interpolation: Literal["smooth", "linear"]


class ShaftDriveStage(TypedDict, total=False):
    """Fields of stage.

    kind : Kind of the stage.
    ratio : Speed of its input shaft over that of its output (u); > 0 and <= 1e+06.
    efficiency : Power given over power taken (eta); > 0 and <= 1.
    output_inertia : Inertia that turns with the stage's output shaft (J_2), kg*m^2; >= 0 kg*m^2 and <= 1e+12 kg*m^2.
    inertia : Inertia that turns with the stage's input shaft (J_1), kg*m^2; >= 0 kg*m^2 and <= 1e+12 kg*m^2.
    mass : Mass that the stage moves: of the belt or chain, or what goes with the nut or rack (m), kg; >= 0 kg and <=
        1e+09 kg.
    radius : Radius of the driving pulley or sprocket, or of the rack's pinion; required for a rack (r), m; >= 0 m and
        <= 1000 m.
    lead : Way of the nut in a revolution of the screw (p), m; > 0 m and <= 1000 m.
    stiffness : Torque over twist, of a coupling or of an elastic shaft (k), N*m/rad; > 0 N*m/rad and <= 1e+12 N*m/rad.
    relative_damping : Energy lost in a cycle of vibration over the largest elastic energy (psi); >= 0 and <= 100.
    """

    kind: Literal["gear", "belt", "chain", "worm", "screw_nut", "rack", "coupling"]
    ratio: Quantity
    efficiency: Quantity
    output_inertia: Quantity
    inertia: Quantity
    mass: Quantity
    radius: Quantity
    lead: Quantity
    stiffness: Quantity
    relative_damping: Quantity


class ShaftDriveFlywheel(TypedDict, total=False):
    """A flywheel given by its dimensions, on a shaft of the train.

    kind : Shape of the flywheel: thin rim or solid disc by the mass, or ring: a rim by width and thickness.
    shaft : Number of the shaft on which it sits: K is the input shaft of stage K, 0 the motor's; by default the main
        shaft.
    diameter : Mean diameter of the rim, or outer diameter of the disc (D), m; > 0 m and <= 1000 m.
    mass : Mass of the rim or disc (m), kg; > 0 kg and <= 1e+09 kg.
    density : Density of its material (rho), kg/m^3; > 0 kg/m^3 and <= 100000 kg/m^3.
    poisson_ratio : Poisson's ratio of its material (nu); >= 0 and <= 0.5.
    allowed_stress : Stress that determines its margin (s_a), Pa; > 0 Pa and <= 1e+12 Pa.
    width : Width of the rim along its shaft (b), m; > 0 m and <= 1000 m.
    thickness : Thickness of the rim along its radius (t), m; > 0 m and <= 1000 m.
    """

    kind: Literal["rim", "disc", "ring"]
    shaft: int
    diameter: Quantity
    mass: Quantity
    density: Quantity
    poisson_ratio: Quantity
    allowed_stress: Quantity
    width: Quantity
    thickness: Quantity


class ShaftDrive(TypedDict, total=False):
    """What turns the shaft.

    inertia : Inertia that turns with the shaft; required without stages and flywheel (I'), kg*m^2; >= 0 kg*m^2 and <=
        1e+12 kg*m^2.
    torque : Driving torque; at the motor where there are stages (M_d), N*m; >= -1e+30 N*m and <= 1e+30 N*m.
    scale : Factor on the driving torque (k_d); >= -1e+30 and <= 1e+30.
    motor : A motor whose torque depends on its speed; fields kind, no_load_speed, stall_torque, inertia, rated_torque,
        synchronous_speed, breakdown_torque, breakdown_slip, scale, table, csv, interpolation; needed: kind.
    stages : Stages between motor and main shaft, motor first; fields kind, ratio, efficiency, output_inertia, inertia,
        mass, radius, lead, stiffness, relative_damping; needed: kind.
    flywheel : A flywheel given by its dimensions, on a shaft of the train; fields kind, shaft, diameter, mass, density,
        poisson_ratio, allowed_stress, width, thickness; needed: kind, diameter.
    """

    inertia: Quantity
    torque: Quantity
    scale: Quantity
    motor: ShaftDriveMotor
    stages: Sequence[ShaftDriveStage]
    flywheel: ShaftDriveFlywheel


class ShaftMechanismSliderCrank(TypedDict, total=False):
    """Fields of slider_crank.

    weights : Whether the ram alone has a weight, or rods, couplers and blocks too.
    bodies : Rods and couplers as full bodies, or as two masses on their pins.
    crank : Length of the crank (r), m; > 0 m and <= 1000 m.
    rod : Length of the connecting rod (L), m; > 0 m and <= 1000 m.
    offset : Height of the ram's line above its crank's centre (e), m; >= -1000 m and <= 1000 m.
    rod_centre : Crank pin to the rod's centre of mass (s), m; >= -1000 m and <= 1000 m.
    rod_mass : Mass of the rod (m2), kg; >= 0 kg and <= 1e+09 kg.
    rod_inertia : Inertia of the rod about its centre of mass (J2), kg*m^2; >= 0 kg*m^2 and <= 1e+12 kg*m^2.
    ram_mass : Mass of the ram (m3), kg; >= 0 kg and <= 1e+09 kg.
    inclination : Rise of the forward stroke above the level (beta), rad; >= -6.28319 rad and <= 6.28319 rad.
    """

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
    """Fields of four_bar.

    weights : Whether the ram alone has a weight, or rods, couplers and blocks too.
    bodies : Rods and couplers as full bodies, or as two masses on their pins.
    frame : Distance of the fixed pivots (d), m; > 0 m and <= 1000 m.
    crank : Length of the crank (a), m; > 0 m and <= 1000 m.
    coupler : Length of the coupler (b), m; > 0 m and <= 1000 m.
    rocker : Length of the rocker (c), m; > 0 m and <= 1000 m.
    coupler_centre : Crank pin to its centre of mass (s), m; >= -1000 m and <= 1000 m.
    coupler_mass : Mass of the coupler (m2), kg; >= 0 kg and <= 1e+09 kg.
    coupler_inertia : Inertia of the coupler about its centre of mass (J2), kg*m^2; >= 0 kg*m^2 and <= 1e+12 kg*m^2.
    rocker_inertia : Inertia of the rocker about its pivot (J3), kg*m^2; >= 0 kg*m^2 and <= 1e+12 kg*m^2.
    tray_mass : Mass carried along the arc of the rocker's pin (m4), kg; >= 0 kg and <= 1e+09 kg.
    inclination : Rise of the frame above the level, from the shaft to the rocker's pivot; with `weights` "all" (beta),
        rad; >= -6.28319 rad and <= 6.28319 rad.
    """

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
    """Fields of drag_link.

    weights : Whether the ram alone has a weight, or rods, couplers and blocks too.
    bodies : Rods and couplers as full bodies, or as two masses on their pins.
    frame : Distance of the fixed pivots (d), m; > 0 m and <= 1000 m.
    frame_angle : Direction of the follower's pivot from the far side (beta_0), rad; >= -6.28319 rad and <= 6.28319 rad.
    crank : Length of the crank (a), m; > 0 m and <= 1000 m.
    coupler : Length of the coupler (b), m; > 0 m and <= 1000 m.
    coupler_centre : Crank pin to its centre of mass (s_2), m; >= -1000 m and <= 1000 m.
    coupler_mass : Mass of the coupler (m_2), kg; >= 0 kg and <= 1e+09 kg.
    coupler_inertia : Inertia of the coupler about its centre of mass (J_2), kg*m^2; >= 0 kg*m^2 and <= 1e+12 kg*m^2.
    follower : Follower's pivot to the coupler's pin (c), m; > 0 m and <= 1000 m.
    arm : Follower's pivot to the rod's pin (R), m; > 0 m and <= 1000 m.
    arm_angle : Angle by which the rod's pin is ahead of the coupler's (beta_1), rad; >= -6.28319 rad and <= 6.28319
        rad.
    follower_inertia : Inertia of the follower about its pivot (J_3), kg*m^2; >= 0 kg*m^2 and <= 1e+12 kg*m^2.
    rod : Length of the connecting rod (L), m; > 0 m and <= 1000 m.
    offset : Height of the ram's line above its crank's centre (e), m; >= -1000 m and <= 1000 m.
    rod_centre : Crank pin to the rod's centre of mass (s), m; >= -1000 m and <= 1000 m.
    rod_mass : Mass of the rod (m2), kg; >= 0 kg and <= 1e+09 kg.
    rod_inertia : Inertia of the rod about its centre of mass (J2), kg*m^2; >= 0 kg*m^2 and <= 1e+12 kg*m^2.
    ram_mass : Mass of the ram (m3), kg; >= 0 kg and <= 1e+09 kg.
    inclination : Rise of the forward stroke above the level (beta), rad; >= -6.28319 rad and <= 6.28319 rad.
    """

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
    """Fields of toggle.

    weights : Whether the ram alone has a weight, or rods, couplers and blocks too.
    bodies : Rods and couplers as full bodies, or as two masses on their pins.
    frame : Distance of the fixed pivots (d), m; > 0 m and <= 1000 m.
    crank : Length of the crank (a), m; > 0 m and <= 1000 m.
    coupler : Length of the coupler (b), m; > 0 m and <= 1000 m.
    coupler_centre : Crank pin to its centre of mass (s_2), m; >= -1000 m and <= 1000 m.
    coupler_mass : Mass of the coupler (m_2), kg; >= 0 kg and <= 1e+09 kg.
    coupler_inertia : Inertia of the coupler about its centre of mass (J_2), kg*m^2; >= 0 kg*m^2 and <= 1e+12 kg*m^2.
    rocker : Length of the rocker (c), m; > 0 m and <= 1000 m.
    line_angle : Direction of the ram's line from the frame beyond the pivot (lambda), rad; >= -6.28319 rad and <=
        6.28319 rad.
    rocker_inertia : Inertia of the rocker about its pivot (J_3), kg*m^2; >= 0 kg*m^2 and <= 1e+12 kg*m^2.
    rod : Length of the connecting rod (L), m; > 0 m and <= 1000 m.
    rod_centre : Crank pin to the rod's centre of mass (s), m; >= -1000 m and <= 1000 m.
    rod_mass : Mass of the rod (m2), kg; >= 0 kg and <= 1e+09 kg.
    rod_inertia : Inertia of the rod about its centre of mass (J2), kg*m^2; >= 0 kg*m^2 and <= 1e+12 kg*m^2.
    ram_mass : Mass of the ram (m3), kg; >= 0 kg and <= 1e+09 kg.
    inclination : Rise of the forward stroke above the level (beta), rad; >= -6.28319 rad and <= 6.28319 rad.
    """

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
    """Fields of scotch_yoke.

    crank : Length of the crank (r), m; > 0 m and <= 1000 m.
    yoke_mass : Mass of the yoke and what slides with it (m), kg; >= 0 kg and <= 1e+09 kg.
    block_mass : Mass of the sliding block on the crank pin (m_b), kg; >= 0 kg and <= 1e+09 kg.
    inclination : Rise of the forward stroke above the level (beta), rad; >= -6.28319 rad and <= 6.28319 rad.
    """

    crank: Quantity
    yoke_mass: Quantity
    block_mass: Quantity
    inclination: Quantity


class ShaftMechanismParallelCrank(TypedDict, total=False):
    """Fields of parallel_crank.

    crank : Length of both cranks (r), m; > 0 m and <= 1000 m.
    coupler_mass : Mass of the coupler and what goes round with it (m), kg; >= 0 kg and <= 1e+09 kg.
    driven_inertia : Inertia of the second crank about its pivot (J_3), kg*m^2; >= 0 kg*m^2 and <= 1e+12 kg*m^2.
    inclination : Rise of the forward stroke above the level (beta), rad; >= -6.28319 rad and <= 6.28319 rad.
    """

    crank: Quantity
    coupler_mass: Quantity
    driven_inertia: Quantity
    inclination: Quantity


class ShaftMechanismQuickReturn(TypedDict, total=False):
    """Fields of quick_return.

    kind : Kind of the quick return.
    weights : Whether the ram alone has a weight, or rods, couplers and blocks too.
    bodies : Rods and couplers as full bodies, or as two masses on their pins.
    crank : Length of the crank (r), m; > 0 m and <= 1000 m.
    pivot_distance : Distance of the link's pivot below the shaft (d), m; > 0 m and <= 1000 m.
    link_arm : Link's pivot to the rod's pin (R), m; > 0 m and <= 1000 m.
    rod : Length of the connecting rod (L), m; > 0 m and <= 1000 m.
    offset : Height of the ram's line above its crank's centre (e), m; >= -1000 m and <= 1000 m.
    rod_centre : Crank pin to the rod's centre of mass (s), m; >= -1000 m and <= 1000 m.
    rod_mass : Mass of the rod (m2), kg; >= 0 kg and <= 1e+09 kg.
    rod_inertia : Inertia of the rod about its centre of mass (J2), kg*m^2; >= 0 kg*m^2 and <= 1e+12 kg*m^2.
    ram_mass : Mass of the ram (m3), kg; >= 0 kg and <= 1e+09 kg.
    inclination : Rise of the forward stroke above the level (beta), rad; >= -6.28319 rad and <= 6.28319 rad.
    link_inertia : Inertia of the slotted link about its pivot (J_l), kg*m^2; >= 0 kg*m^2 and <= 1e+12 kg*m^2.
    block_mass : Mass of the sliding block on the crank pin (m_b), kg; >= 0 kg and <= 1e+09 kg.
    """

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
    """Fields of cam.

    rise : Law of the rise.
    fall : Law of the fall.
    lift : Lift of the follower (h), m; > 0 m and <= 1000 m.
    start : Angle at which the rise begins (phi_0), rad; >= 0 rad and <= 6.28319 rad.
    rise_angle : Angle of the rise (beta_1), rad; > 0 rad and <= 6.28319 rad.
    dwell_angle : Angle of the upper dwell (beta_2), rad; >= 0 rad and <= 6.28319 rad.
    fall_angle : Angle of the fall (beta_3), rad; > 0 rad and <= 6.28319 rad.
    follower_mass : Mass of the follower (m), kg; >= 0 kg and <= 1e+09 kg.
    spring_rate : Rate of the follower's spring (c), N/m; >= 0 N/m and <= 1e+12 N/m.
    spring_preload : Force of the follower's spring at no lift (F_0), N; >= 0 N and <= 1e+12 N.
    inclination : Rise of the forward stroke above the level (beta), rad; >= -6.28319 rad and <= 6.28319 rad.
    """

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


class ShaftMechanismLinkage(TypedDict, total=False):
    """A planar linkage of one's own: a crank, and groups of two links that are attached to it one after the other.

    crank : Length of the crank (r), m; > 0 m and <= 1000 m.
    inclination : Rise of the x axis above the level (beta), rad; >= -6.28319 rad and <= 6.28319 rad.
    elements : Pivots, points and groups, each after those to which it is attached; fields kind, name, from, to, guide,
        guide_2, on, branch, x, y, along, across, mass, first, first_centre, first_across, first_mass, first_inertia,
        second, second_centre, second_across, second_mass, second_inertia, angle, offset, inertia, block_mass,
        slot_angle, angle_2, offset_2; needed: kind, name.
    working : Joint of the working part: a slider on the frame, or a joint on an arc; by default none.
    forward : Forward stroke along the guide or counterclockwise, or the other way.
    """

    crank: Quantity
    inclination: Quantity
    elements: Sequence[Mapping[str, Any]]
    working: str
    forward: Literal["positive", "negative"]


class ShaftMechanism(TypedDict, total=False):
    """What the shaft drives: a table, a formula, or dimensions and masses.

    table : Rows of angle (rad) and reduced inertia (kg*m^2).
    csv : Angle (rad) and reduced inertia (kg*m^2) as the text of a CSV file, headings with units in brackets.
    formula : Reduced inertia in kg*m^2 as a formula of phi (rad).
    slider_crank : Fields weights, bodies, crank, rod, offset, rod_centre, rod_mass, rod_inertia, ram_mass, inclination;
        needed: crank, rod.
    four_bar : Fields weights, bodies, frame, crank, coupler, rocker, coupler_centre, coupler_mass, coupler_inertia,
        rocker_inertia, tray_mass, inclination; needed: frame, crank, coupler, rocker.
    drag_link : Fields weights, bodies, frame, frame_angle, crank, coupler, coupler_centre, coupler_mass,
        coupler_inertia, follower, arm, arm_angle, follower_inertia, rod, offset, rod_centre, rod_mass, rod_inertia,
        ram_mass, inclination; needed: frame, crank, coupler, follower, arm, rod.
    toggle : Fields weights, bodies, frame, crank, coupler, coupler_centre, coupler_mass, coupler_inertia, rocker,
        line_angle, rocker_inertia, rod, rod_centre, rod_mass, rod_inertia, ram_mass, inclination; needed: frame, crank,
        coupler, rocker, rod.
    scotch_yoke : Fields crank, yoke_mass, block_mass, inclination; needed: crank.
    parallel_crank : Fields crank, coupler_mass, driven_inertia, inclination; needed: crank.
    quick_return : Fields kind, weights, bodies, crank, pivot_distance, link_arm, rod, offset, rod_centre, rod_mass,
        rod_inertia, ram_mass, inclination, link_inertia, block_mass; needed: kind, crank, pivot_distance, link_arm,
        rod.
    cam : Fields rise, fall, lift, start, rise_angle, dwell_angle, fall_angle, follower_mass, spring_rate,
        spring_preload, inclination; needed: lift, rise_angle, fall_angle.
    linkage : A planar linkage of one's own: a crank, and groups of two links that are attached to it one after the
        other; fields crank, inclination, elements, working, forward; needed: crank, elements.
    interpolation : How rows of the table are joined: without overshoot, or by straight lines.
    """

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
    linkage: ShaftMechanismLinkage
    interpolation: Literal["smooth", "linear"]


class ShaftOperationGas(TypedDict, total=False):
    """A gas drawn in and compressed by the working part.

    piston_area : Area of the piston (A), m^2; > 0 m^2 and <= 1e+06 m^2.
    suction_pressure : Absolute pressure of suction (p_1), Pa; > 0 Pa and <= 1e+12 Pa.
    discharge_pressure : Absolute pressure of discharge (p_2), Pa; > 0 Pa and <= 1e+12 Pa.
    back_pressure : Pressure on the piston's back (p_0), Pa; >= 0 Pa and <= 1e+12 Pa.
    clearance : Clearance volume over displaced volume (c); >= 0 and <= 10.
    exponent : Exponent of compression and expansion (n); >= 0.001 and <= 10.
    """

    piston_area: Quantity
    suction_pressure: Quantity
    discharge_pressure: Quantity
    back_pressure: Quantity
    clearance: Quantity
    exponent: Quantity


class ShaftOperationIndicator(TypedDict, total=False):
    """The pressure on the piston as measured.

    over : Against the shaft's angle, or the volume as fraction of the stroke, or recorded over time.
    recorded_at : Mean speed of the shaft while the diagram was recorded over time, rad/s; > 0 rad/s and <= 1e+06 rad/s.
    table : Rows of angle (rad), fraction of the stroke, to and fro in every revolution, or time (s), and pressure (Pa).
    csv : Angle (rad), fraction of the stroke, to and fro in every revolution, or time (s), and pressure (Pa) as the
        text of a CSV file, headings with units in brackets.
    interpolation : How rows of the table are joined: without overshoot, or by straight lines.
    piston_area : Area of the piston (A), m^2; > 0 m^2 and <= 1e+06 m^2.
    back_pressure : Pressure on the piston's back (p_0), Pa; >= 0 Pa and <= 1e+12 Pa.
    """

    over: Literal["angle", "stroke", "time"]
    recorded_at: Quantity
    table: Sequence[Sequence[Quantity]]
    csv: str
    interpolation: Literal["smooth", "linear"]
    piston_area: Quantity
    back_pressure: Quantity


class ShaftOperation(TypedDict, total=False):
    """What resists.

    value : Resistance, the same at every angle; N*m for a torque (F), N; >= -1e+30 N and <= 1e+30 N.
    steps : Constant pieces; zero elsewhere; fields from, to, value.
    table : Rows of angle (rad), fraction of the stroke or time (s), and force (N) or torque (N*m).
    csv : Angle (rad), fraction of the stroke or time (s), and force (N) or torque (N*m) as the text of a CSV file,
        headings with units in brackets.
    formula : Force or torque as a formula of phi (rad), t (s), x (fraction of the stroke) and omega (rad/s).
    gas : A gas drawn in and compressed by the working part; fields piston_area, suction_pressure, discharge_pressure,
        back_pressure, clearance, exponent; needed: piston_area, suction_pressure, discharge_pressure.
    indicator : The pressure on the piston as measured; fields over, recorded_at, table, csv, interpolation,
        piston_area, back_pressure; needed: piston_area.
    quantity : A force on the working part, or a torque on the shaft.
    over : Against the shaft's angle, or the fraction of the stroke, or recorded over time.
    during : Strokes in which a diagram over the stroke holds.
    sense : A force against the motion, or always against the forward stroke.
    efficiency_is : Whether the efficiency is the share of the power that passes at each angle, or of the work of a
        cycle.
    interpolation : How rows of the table are joined: without overshoot, or by straight lines.
    scale : Factor on the whole diagram (k); >= -1e+30 and <= 1e+30.
    efficiency : Power given over power taken between the shaft and the operation (eta); > 0 and <= 1.
    recorded_at : Mean speed of the shaft while the diagram was recorded over time, rad/s; > 0 rad/s and <= 1e+06 rad/s.
    """

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
    efficiency_is: Literal["power", "work"]
    interpolation: Literal["smooth", "linear"]
    scale: Quantity
    efficiency: Quantity
    recorded_at: Quantity


class ShaftPart(TypedDict, total=False):
    """A mechanism with its operation; their angle is that of the shaft, times the ratio, plus the crank angle.

    crank_angle : Angle of the part's crank at the shaft's angle 0 (alpha), rad; >= -400 rad and <= 400 rad.
    ratio : Speed of the part's shaft over that of the main shaft (i); > 0 and <= 60.
    cycle : Revolutions of the part's shaft after which the part repeats itself; by default all of its revolutions in a
        cycle of the machine.
    mechanism : What the shaft drives: a table, a formula, or dimensions and masses; fields table, csv, formula,
        slider_crank, four_bar, drag_link, toggle, scotch_yoke, parallel_crank, quick_return, cam, linkage,
        interpolation.
    operation : What resists; fields value, steps, table, csv, formula, gas, indicator, quantity, over, during, sense,
        efficiency_is, interpolation, scale, efficiency, recorded_at.
    """

    crank_angle: Quantity
    ratio: Quantity
    cycle: Any
    mechanism: ShaftMechanism
    operation: ShaftOperation


class ShaftRun(TypedDict, total=False):
    """Which results the cases have; a machine shaft is solved for its whole cycle at once.

    loads : Whether the results have stroke, speed, acceleration and force of the working parts, the forces in the
        joints and the torques in the couplings, too; each case takes longer.
    """

    loads: bool


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
        "drive.motor.rated_torque",
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
        "drive.stages.*.stiffness",
        "drive.stages.*.relative_damping",
        "drive.flywheel.diameter",
        "drive.flywheel.mass",
        "drive.flywheel.density",
        "drive.flywheel.poisson_ratio",
        "drive.flywheel.allowed_stress",
        "drive.flywheel.width",
        "drive.flywheel.thickness",
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
        "mechanism.linkage.crank",
        "mechanism.linkage.inclination",
        "mechanism.linkage.elements.*.x",
        "mechanism.linkage.elements.*.y",
        "mechanism.linkage.elements.*.along",
        "mechanism.linkage.elements.*.across",
        "mechanism.linkage.elements.*.mass",
        "mechanism.linkage.elements.*.first",
        "mechanism.linkage.elements.*.first_centre",
        "mechanism.linkage.elements.*.first_across",
        "mechanism.linkage.elements.*.first_mass",
        "mechanism.linkage.elements.*.first_inertia",
        "mechanism.linkage.elements.*.second",
        "mechanism.linkage.elements.*.second_centre",
        "mechanism.linkage.elements.*.second_across",
        "mechanism.linkage.elements.*.second_mass",
        "mechanism.linkage.elements.*.second_inertia",
        "mechanism.linkage.elements.*.angle",
        "mechanism.linkage.elements.*.offset",
        "mechanism.linkage.elements.*.inertia",
        "mechanism.linkage.elements.*.block_mass",
        "mechanism.linkage.elements.*.slot_angle",
        "mechanism.linkage.elements.*.angle_2",
        "mechanism.linkage.elements.*.offset_2",
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
        "parts.*.ratio",
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
        "parts.*.mechanism.linkage.crank",
        "parts.*.mechanism.linkage.inclination",
        "parts.*.mechanism.linkage.elements.*.x",
        "parts.*.mechanism.linkage.elements.*.y",
        "parts.*.mechanism.linkage.elements.*.along",
        "parts.*.mechanism.linkage.elements.*.across",
        "parts.*.mechanism.linkage.elements.*.mass",
        "parts.*.mechanism.linkage.elements.*.first",
        "parts.*.mechanism.linkage.elements.*.first_centre",
        "parts.*.mechanism.linkage.elements.*.first_across",
        "parts.*.mechanism.linkage.elements.*.first_mass",
        "parts.*.mechanism.linkage.elements.*.first_inertia",
        "parts.*.mechanism.linkage.elements.*.second",
        "parts.*.mechanism.linkage.elements.*.second_centre",
        "parts.*.mechanism.linkage.elements.*.second_across",
        "parts.*.mechanism.linkage.elements.*.second_mass",
        "parts.*.mechanism.linkage.elements.*.second_inertia",
        "parts.*.mechanism.linkage.elements.*.angle",
        "parts.*.mechanism.linkage.elements.*.offset",
        "parts.*.mechanism.linkage.elements.*.inertia",
        "parts.*.mechanism.linkage.elements.*.block_mass",
        "parts.*.mechanism.linkage.elements.*.slot_angle",
        "parts.*.mechanism.linkage.elements.*.angle_2",
        "parts.*.mechanism.linkage.elements.*.offset_2",
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
        run: ShaftRun | None = None,
        derive: Mapping[str, Any] | None = None,
    ) -> None:
        """A study of the model 'machine-shaft': the machine that every case begins from.

        Parameters
        ----------
        drive : values
            What turns the shaft; fields inertia, torque, scale, motor, stages, flywheel.
        cycle : values, optional
            Revolutions of a cycle, 1 to 60.
        mean_speed : number or text with a unit, optional
            Required mean speed of the shaft (w_m), rad/s; > 0 rad/s and <= 1e+06 rad/s.
        mean_speed_is : values, optional
            Which mean of the speed the given mean speed and the irregularity refer to.
        mechanism : values, optional
            What the shaft drives: a table, a formula, or dimensions and masses; fields table, csv, formula,
            slider_crank, four_bar, drag_link, toggle, scotch_yoke, parallel_crank, quick_return, cam, linkage,
            interpolation.
        operation : values, optional
            What resists; fields value, steps, table, csv, formula, gas, indicator, quantity, over, during, sense,
            efficiency_is, interpolation, scale, efficiency, recorded_at.
        parts : values, optional
            Several mechanisms, each with its operation, at its crank angle and on its shaft; fields crank_angle, ratio,
            cycle, mechanism, operation.
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
            Irregularity that determines the required inertia (delta); > 0 and <= 2.
        friction_torque : number or text with a unit, optional
            Friction of the shaft, always resisting (M_f), N*m; >= 0 N*m and <= 1e+12 N*m.
        gravity : number or text with a unit, optional
            Gravitational acceleration (g), m/s^2; >= 0 m/s^2 and <= 1000 m/s^2.
        name : str, optional
            Name of the study.
        run : values, optional
            Which results the cases have; a machine shaft is solved for its whole cycle at once; fields loads.
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
