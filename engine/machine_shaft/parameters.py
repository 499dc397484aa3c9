"""Numeric parameters of a machine: paths, SI units, ranges, defaults, by its parts (docs/theory-machine-shaft.md)."""

import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import chain

from sprag_study.engine.catalogue import IN_MM, IN_PERCENT, IN_RPM, STANDARD_GRAVITY, Parameter
from sprag_study.engine.machine_shaft.elements import ElementKind
from sprag_study.engine.machine_shaft.spec import (
    MOVING,
    Flywheel,
    MachineSpec,
    MechanismChoice,
    MechanismKind,
    OperationChoice,
    PartChoice,
    Stage,
)

_INF = math.inf
_TURN = 2.0 * math.pi
_ANY = 1e30
#: Longest plausible part, in m.
_LONGEST = 10.0
#: Largest plausible relative damping of a coupling: rubber has up to about 2.
_MOST_DAMPING = 4.0


def _length(path: str, symbol: str, help_: str, default: float | None = None) -> Parameter:
    return Parameter(path, symbol, "m", 0.0, 1e3, True, default, help_, _LONGEST, IN_MM)


def _way(path: str, symbol: str, help_: str) -> Parameter:
    return Parameter(path, symbol, "m", -1e3, 1e3, False, 0.0, help_, _LONGEST, IN_MM)


def _mass(path: str, symbol: str, help_: str) -> Parameter:
    return Parameter(path, symbol, "kg", 0.0, 1e9, False, 0.0, help_)


def _inertia(path: str, symbol: str, help_: str) -> Parameter:
    return Parameter(path, symbol, "kg*m^2", 0.0, 1e12, False, 0.0, help_)


def _rod_and_ram(kind: str, *, offset: bool = True) -> tuple[Parameter, ...]:
    p = f"mechanism.{kind}"
    line = "height of the ram's line above its crank's centre"
    beside = (_way(f"{p}.offset", "e", line),) if offset else ()
    return (
        _length(f"{p}.rod", "L", "length of the connecting rod"),
        *beside,
        _way(f"{p}.rod_centre", "s", "crank pin to the rod's centre of mass"),
        _mass(f"{p}.rod_mass", "m2", "mass of the rod"),
        _inertia(f"{p}.rod_inertia", "J2", "inertia of the rod about its centre of mass"),
        _mass(f"{p}.ram_mass", "m3", "mass of the ram"),
        _inclination(p),
    )


def _inclination(prefix: str) -> Parameter:
    return _angle(f"{prefix}.inclination", "beta", "rise of the forward stroke above the level")


def _cam_angle(path: str, symbol: str, help_: str, default: float | None, low_open: bool) -> Parameter:
    return Parameter(path, symbol, "rad", 0.0, _TURN, low_open, default, help_)


def _angle(path: str, symbol: str, help_: str) -> Parameter:
    return Parameter(path, symbol, "rad", -_TURN, _TURN, False, 0.0, help_)


def _coupler(kind: str) -> tuple[Parameter, ...]:
    p = f"mechanism.{kind}.coupler"
    return (
        _length(p, "b", "length of the coupler"),
        _way(f"{p}_centre", "s_2", "crank pin to its centre of mass"),
        _mass(f"{p}_mass", "m_2", "mass of the coupler"),
        _inertia(f"{p}_inertia", "J_2", "inertia of the coupler about its centre of mass"),
    )


#: Parameters of each mechanism.
MECHANISM_PARAMETERS: Mapping[MechanismKind, tuple[Parameter, ...]] = {
    "none": (),
    "table": (),
    "formula": (),
    "slider_crank": (
        _length("mechanism.slider_crank.crank", "r", "length of the crank"),
        *_rod_and_ram("slider_crank"),
    ),
    "scotch_yoke": (
        _length("mechanism.scotch_yoke.crank", "r", "length of the crank"),
        _mass("mechanism.scotch_yoke.yoke_mass", "m", "mass of the yoke and what slides with it"),
        _mass("mechanism.scotch_yoke.block_mass", "m_b", "mass of the sliding block on the crank pin"),
        _inclination("mechanism.scotch_yoke"),
    ),
    "parallel_crank": (
        _length("mechanism.parallel_crank.crank", "r", "length of both cranks"),
        _mass("mechanism.parallel_crank.coupler_mass", "m", "mass of the coupler and what goes round with it"),
        _inertia("mechanism.parallel_crank.driven_inertia", "J_3", "inertia of the second crank about its pivot"),
        _inclination("mechanism.parallel_crank"),
    ),
    "drag_link": (
        _length("mechanism.drag_link.frame", "d", "distance of the fixed pivots"),
        _angle("mechanism.drag_link.frame_angle", "beta_0", "direction of the follower's pivot from the far side"),
        _length("mechanism.drag_link.crank", "a", "length of the crank"),
        *_coupler("drag_link"),
        _length("mechanism.drag_link.follower", "c", "follower's pivot to the coupler's pin"),
        _length("mechanism.drag_link.arm", "R", "follower's pivot to the rod's pin"),
        _angle("mechanism.drag_link.arm_angle", "beta_1", "angle by which the rod's pin is ahead of the coupler's"),
        _inertia("mechanism.drag_link.follower_inertia", "J_3", "inertia of the follower about its pivot"),
        *_rod_and_ram("drag_link"),
    ),
    "toggle": (
        _length("mechanism.toggle.frame", "d", "distance of the fixed pivots"),
        _length("mechanism.toggle.crank", "a", "length of the crank"),
        *_coupler("toggle"),
        _length("mechanism.toggle.rocker", "c", "length of the rocker"),
        _angle("mechanism.toggle.line_angle", "lambda", "direction of the ram's line from the frame beyond the pivot"),
        _inertia("mechanism.toggle.rocker_inertia", "J_3", "inertia of the rocker about its pivot"),
        *_rod_and_ram("toggle", offset=False),
    ),
    "four_bar": (
        _length("mechanism.four_bar.frame", "d", "distance of the fixed pivots"),
        _length("mechanism.four_bar.crank", "a", "length of the crank"),
        _length("mechanism.four_bar.coupler", "b", "length of the coupler"),
        _length("mechanism.four_bar.rocker", "c", "length of the rocker"),
        _way("mechanism.four_bar.coupler_centre", "s", "crank pin to its centre of mass"),
        _mass("mechanism.four_bar.coupler_mass", "m2", "mass of the coupler"),
        _inertia("mechanism.four_bar.coupler_inertia", "J2", "inertia of the coupler about its centre of mass"),
        _inertia("mechanism.four_bar.rocker_inertia", "J3", "inertia of the rocker about its pivot"),
        _mass("mechanism.four_bar.tray_mass", "m4", "mass carried along the arc of the rocker's pin"),
    ),
    "quick_return": (
        _length("mechanism.quick_return.crank", "r", "length of the crank"),
        _length("mechanism.quick_return.pivot_distance", "d", "distance of the link's pivot below the shaft"),
        _length("mechanism.quick_return.link_arm", "R", "link's pivot to the rod's pin"),
        *_rod_and_ram("quick_return"),
        _inertia("mechanism.quick_return.link_inertia", "J_l", "inertia of the slotted link about its pivot"),
        _mass("mechanism.quick_return.block_mass", "m_b", "mass of the sliding block on the crank pin"),
    ),
    "linkage": (
        _length("mechanism.linkage.crank", "r", "length of the crank"),
        _angle("mechanism.linkage.inclination", "beta", "rise of the x axis above the level"),
    ),
    "cam": (
        _length("mechanism.cam.lift", "h", "lift of the follower"),
        _cam_angle("mechanism.cam.start", "phi_0", "angle at which the rise begins", 0.0, False),
        _cam_angle("mechanism.cam.rise_angle", "beta_1", "angle of the rise", None, True),
        _cam_angle("mechanism.cam.dwell_angle", "beta_2", "angle of the upper dwell", 0.0, False),
        _cam_angle("mechanism.cam.fall_angle", "beta_3", "angle of the fall", None, True),
        _mass("mechanism.cam.follower_mass", "m", "mass of the follower"),
        Parameter("mechanism.cam.spring_rate", "c", "N/m", 0.0, 1e12, False, 0.0, "rate of the follower's spring"),
        Parameter(
            "mechanism.cam.spring_preload", "F_0", "N", 0.0, 1e12, False, 0.0,
            "force of the follower's spring at no lift",
        ),
        _inclination("mechanism.cam"),
    ),
}  # fmt: skip

_MOTOR = {
    "linear": (
        Parameter("drive.motor.no_load_speed", "w_0", "rad/s", 0.0, 1e6, True, None, "speed at which its torque is 0"),
        Parameter("drive.motor.stall_torque", "M_0", "N*m", 0.0, 1e12, True, None, "its torque at rest"),
    ),
    "kloss": (
        Parameter("drive.motor.synchronous_speed", "w_s", "rad/s", 0.0, 1e6, True, None, "its synchronous speed"),
        Parameter("drive.motor.breakdown_torque", "M_k", "N*m", 0.0, 1e12, True, None, "its largest torque"),
        Parameter("drive.motor.breakdown_slip", "s_k", "1", 0.0, 1e3, True, None, "slip at its largest torque"),
    ),
    "table": (Parameter("drive.motor.scale", "k_m", "1", 0.0, 1e12, True, 1.0, "factor on the torques of its table"),),
}
_RATED_HELP = "torque that it gives continuously (duty type S1), which determines its thermal margin"
_RATED = Parameter("drive.motor.rated_torque", "M_N", "N*m", 0.0, 1e12, True, _INF, _RATED_HELP)

_WHEEL = (
    _length("drive.flywheel.diameter", "D", "mean diameter of the rim, or outer diameter of the disc"),
    Parameter("drive.flywheel.mass", "m", "kg", 0.0, 1e9, True, None, "mass of the rim or disc"),
    _length("drive.flywheel.width", "b", "width of the rim along its shaft"),
    _length("drive.flywheel.thickness", "t", "thickness of the rim along its radius"),
    Parameter("drive.flywheel.density", "rho", "kg/m^3", 0.0, 1e5, True, 7850.0, "density of its material"),
    Parameter("drive.flywheel.poisson_ratio", "nu", "1", 0.0, 0.5, False, 0.3, "Poisson's ratio of its material"),
    Parameter("drive.flywheel.allowed_stress", "s_a", "Pa", 0.0, 1e12, True, _INF, "stress that determines its margin"),
)

_GAS = (
    Parameter("operation.gas.piston_area", "A", "m^2", 0.0, 1e6, True, None, "area of the piston"),
    Parameter("operation.gas.suction_pressure", "p_1", "Pa", 0.0, 1e12, True, None, "absolute pressure of suction"),
    Parameter("operation.gas.discharge_pressure", "p_2", "Pa", 0.0, 1e12, True, None, "absolute pressure of discharge"),
    Parameter("operation.gas.back_pressure", "p_0", "Pa", 0.0, 1e12, False, 101325.0, "pressure on the piston's back"),
    Parameter("operation.gas.clearance", "c", "1", 0.0, 10.0, False, 0.05, "clearance volume over displaced volume"),
    Parameter("operation.gas.exponent", "n", "1", 1e-3, 10.0, False, 1.3, "exponent of compression and expansion"),
)


_INDICATOR = (
    Parameter("operation.indicator.piston_area", "A", "m^2", 0.0, 1e6, True, None, "area of the piston"),
    Parameter(
        "operation.indicator.back_pressure", "p_0", "Pa", 0.0, 1e12, False, 101325.0, "pressure on the piston's back"
    ),
)


def _operation(operation: OperationChoice, cycle: int) -> tuple[Parameter, ...]:
    if operation.quantity == "none":
        return ()
    factor = Parameter("operation.scale", "k", "1", -_ANY, _ANY, False, 1.0, "factor on the whole diagram")
    loss = "power given over power taken between the shaft and the operation"
    scale = (factor, Parameter("operation.efficiency", "eta", "1", 0.0, 1.0, True, 1.0, loss))
    if operation.quantity == "gas":
        return (*scale, *_GAS)
    if operation.quantity == "pressure":
        return (*scale, *_INDICATOR)
    unit = "N*m" if operation.quantity == "torque" else "N"
    if operation.form == "constant":
        own = Parameter("operation.value", "F", unit, -_ANY, _ANY, False, None, "resistance, the same at every angle")
        return (*scale, own)
    return (*scale, *chain.from_iterable(_step(operation, cycle, k, unit) for k in range(operation.steps)))


def _step(operation: OperationChoice, cycle: int, index: int, unit: str) -> tuple[Parameter, ...]:
    p = f"operation.steps.{index}"
    end, end_unit = (_TURN * cycle, "rad") if operation.over == "angle" else (1.0, "1")
    return (
        Parameter(f"{p}.from", "from", end_unit, 0.0, end, False, None, "where the step begins"),
        Parameter(f"{p}.to", "to", end_unit, 0.0, end, False, None, "where the step ends"),
        Parameter(f"{p}.value", "F", unit, -_ANY, _ANY, False, None, "resistance within the step"),
    )


def _stage(index: int, kind: Stage) -> tuple[Parameter, ...]:
    p = f"drive.stages.{index}"
    common = (
        _inertia(f"{p}.inertia", "J_1", "inertia that turns with the stage's input shaft"),
        _mass(f"{p}.mass", "m", "mass that the stage moves: of the belt or chain, or what goes with the nut or rack"),
    )
    if kind == "screw_nut":
        return (_length(f"{p}.lead", "p", "way of the nut in a revolution of the screw"), *common)
    radius = "radius of the driving pulley or sprocket, or of the rack's pinion"
    if kind in MOVING:
        return (_length(f"{p}.radius", "r", radius), *common)
    output = _inertia(f"{p}.output_inertia", "J_2", "inertia that turns with the stage's output shaft")
    if kind == "coupling":
        stiff = "torque over twist, of a coupling or of an elastic shaft"
        loss = "energy lost in a cycle of vibration over the largest elastic energy"
        return (
            Parameter(f"{p}.stiffness", "k", "N*m/rad", 0.0, 1e12, True, None, stiff),
            Parameter(f"{p}.relative_damping", "psi", "1", 0.0, 100.0, False, 0.0, loss, _MOST_DAMPING, IN_PERCENT),
            output,
            common[0],
        )
    turning = (
        Parameter(f"{p}.ratio", "u", "1", 0.0, 1e6, True, None, "speed of its input shaft over that of its output"),
        Parameter(f"{p}.efficiency", "eta", "1", 0.0, 1.0, True, 1.0, "power given over power taken"),
        output,
    )
    if kind in {"gear", "worm"}:
        return (*turning, common[0])
    return (*turning, *common, Parameter(f"{p}.radius", "r", "m", 0.0, 1e3, False, 0.0, radius, _LONGEST, IN_MM))


_CRANK_ANGLE = Parameter(
    "crank_angle", "alpha", "rad", -400.0, 400.0, False, 0.0, "angle of the part's crank at the shaft's angle 0"
)


def _link(p: str, end: str, which: str, symbol: str) -> tuple[Parameter, ...]:
    return (
        _way(f"{p}.{end}_centre", f"s_{symbol}", f"{which} outer joint to the centre of mass, along the {which} link"),
        _way(f"{p}.{end}_across", f"n_{symbol}", f"centre of mass of the {which} link to the left of its line"),
        _mass(f"{p}.{end}_mass", f"m_{symbol}", f"mass of the {which} link"),
        _inertia(f"{p}.{end}_inertia", f"J_{symbol}", f"inertia of the {which} link about its centre of mass"),
    )


def _guide(p: str, suffix: str = "") -> tuple[Parameter, ...]:
    which = "second guide" if suffix else "guide"
    return (
        _angle(f"{p}.angle{suffix}", f"gamma{suffix}", f"direction of the {which} from that of its link"),
        _way(f"{p}.offset{suffix}", f"e{suffix}", f"line of the {which} to the left of its joint"),
    )


def _element(index: int, kind: ElementKind) -> tuple[Parameter, ...]:
    """Parameters of an element of a linkage."""
    p = f"mechanism.linkage.elements.{index}"
    first = (_length(f"{p}.first", "l_1", "length of the first link"), *_link(p, "first", "first", "1"))
    bar = _link(p, "second", "second", "2")
    block = _mass(f"{p}.block_mass", "m_b", "mass of the block on the joint")
    sliding = (
        _mass(f"{p}.mass", "m", "mass of what slides on the guide, or of a point"),
        _inertia(f"{p}.inertia", "J", "inertia of what slides about its joint, where its guide turns"),
    )
    return {
        "pivot": (_way(f"{p}.x", "x", "x of a fixed pivot"), _way(f"{p}.y", "y", "y of a fixed pivot")),
        "point": (
            _way(f"{p}.along", "s", "outer joint of its link to a point, along the link"),
            _way(f"{p}.across", "n", "point to the left of the line of its link"), sliding[0],
        ),
        "RRR": (*first, _length(f"{p}.second", "l_2", "length of the second link"), *bar),
        "RRP": (*first, *_guide(p), *sliding),
        "RPR": (_way(f"{p}.offset", "e", "line of the guide to the left of its joint"), *bar, block),
        "RPP": (*_guide(p), replace(_angle(f"{p}.slot_angle", "sigma", "direction of the slot from that of the guide"),
                                    default=0.25 * _TURN), *sliding, block),
        "PRP": (*_guide(p), *_guide(p, "_2"), block),
    }[kind]  # fmt: skip


def _mechanism(choice: MechanismChoice) -> tuple[Parameter, ...]:
    every = MECHANISM_PARAMETERS[choice.kind]
    if choice.linkage is not None:
        elements = (_element(index, each.kind) for index, each in enumerate(choice.linkage.elements))
        return (*every, *chain.from_iterable(elements))
    if choice.kind == "four_bar" and choice.weights == "all":
        frame = "rise of the frame above the level, from the shaft to the rocker's pivot"
        every += (_angle("mechanism.four_bar.inclination", "beta", frame),)
    if choice.bodies == "full":
        return every
    return tuple(entry for entry in every if not entry.path.endswith(("rod_inertia", "coupler_inertia")))


def _part(prefix: str, part: PartChoice, cycle: int) -> tuple[Parameter, ...]:
    """Parameters of a mechanism and its operation; with a crank angle where it is one of several."""
    own = (*_mechanism(part.mechanism), *_operation(part.operation, part.cycle_in(cycle)))
    if not prefix:
        return own
    return tuple(replace(entry, path=prefix + entry.path) for entry in (_CRANK_ANGLE, *own))


def _drive(spec: MachineSpec) -> tuple[Parameter, ...]:
    if spec.balance == "motor":
        rotor = _inertia("drive.motor.inertia", "J_m", "inertia of its rotor")
        return (*_MOTOR[spec.drive.motor], rotor, _RATED) if spec.drive.motor else ()
    if spec.drive.form == "constant":
        return (Parameter("drive.torque", "M_d", "N*m", -_ANY, _ANY, False, 0.0, "driving torque"),)
    return (Parameter("drive.scale", "k_d", "1", -_ANY, _ANY, False, 1.0, "factor on the driving torque"),)


def _flywheel(kind: Flywheel) -> tuple[Parameter, ...]:
    """Parameters of a flywheel: a mass, or of a ring the width and the thickness that give it."""
    foreign = {"drive.flywheel.mass"} if kind == "ring" else {"drive.flywheel.width", "drive.flywheel.thickness"}
    return tuple(entry for entry in _WHEEL if entry.path not in foreign)


def parameters(spec: MachineSpec) -> tuple[Parameter, ...]:
    """Every numeric parameter of a machine of this structure, in SI units."""
    speed = (
        ()
        if spec.balance == "motor"
        else (
            Parameter(
                "mean_speed", "w_m", "rad/s", 0.0, 1e6, True, None, "required mean speed of the shaft", 1e3, IN_RPM
            ),
        )
    )
    own = 0.0 if spec.drive.stages or spec.drive.flywheel else None
    return (
        *speed,
        Parameter("friction_torque", "M_f", "N*m", 0.0, 1e12, False, 0.0, "friction of the shaft, always resisting"),
        Parameter("gravity", "g", "m/s^2", 0.0, 1e3, False, STANDARD_GRAVITY, "gravitational acceleration"),
        Parameter("drive.inertia", "I'", "kg*m^2", 0.0, 1e12, False, own, "inertia that turns with the shaft"),
        Parameter(
            "wanted_irregularity",
            "delta",
            "1",
            0.0,
            2.0,
            True,
            _INF,
            "irregularity that determines the required inertia",
        ),
        *_drive(spec),
        *(_flywheel(spec.drive.flywheel) if spec.drive.flywheel else ()),
        *chain.from_iterable(_stage(index, kind) for index, kind in enumerate(spec.drive.stages)),
        *chain.from_iterable(_part(prefix, part, spec.cycle) for prefix, part in spec.every_part()),
        *(
            Parameter(f"constants.{name}", name, "1", -_ANY, _ANY, False, None, "constant of the formulas")
            for name in spec.constants
        ),
    )
