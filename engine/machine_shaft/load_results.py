"""What the working parts, joints and couplings of a machine have to bear, as results of cases that a study asks for.

(docs/theory-machine-shaft.md, "Loads".)
"""

from sprag_study.engine.catalogue import ResultInfo
from sprag_study.engine.machine_shaft.joints import joint_names
from sprag_study.engine.machine_shaft.spec import MAX_PARTS, MAX_STAGES, MachineSpec

#: Most joints of a machine whose forces are results.
MAX_JOINTS = 64
#: Joints of a slider-crank, with the columns of the table over the angle that their forces have.
SLIDER_JOINTS = ("crank_pin", "guide")

_R = ResultInfo
_WHOLE = (
    _R("energy.start", "J", "kinetic energy at the angle 0 (T_0)"),
    _R("inertia.mechanism.max", "kg*m^2", "largest reduced inertia of the mechanism (I'')"),
    _R("inertia.ratio", "1", "largest I'' / I', the inertia of the drive; below 1 by the criterion (I'')max < I'"),
)
_OF_PART = (
    ("stroke", "m", "way of the working part from one dead centre to the other"),
    ("speed.max", "m/s", "largest speed of the working part in magnitude"),
    ("acceleration.max", "m/s^2", "largest acceleration of the working part along its way in magnitude"),
    ("force.max", "N", "largest force of the operation on the working part in magnitude"),
)
_OF_JOINT = (
    ("max", "N", "largest force in the joint"),
    ("rms", "N", "root mean square of the force in the joint over the angle"),
    ("direction", "rad", "direction of the largest force in the joint, from the x axis"),
    ("angle_at_max", "rad", "angle of the shaft at which the force in the joint is largest"),
)
_OF_COUPLING = (
    ("torque.max", "N*m", "largest torque in the coupling in magnitude, at its own shaft"),
    ("torque.amplitude", "N*m", "half the range of the torque in the coupling, at its own shaft"),
    ("dynamic_factor", "1", "largest torque in the coupling / largest with a rigid train"),
)


def joints_of(model: MachineSpec) -> tuple[str, ...]:
    """Names of the joints whose forces are known, in the order of their numbers: ``crank_pin``, ``parts.1.B.inner``.

    Each has its columns in the table over the angle.
    """
    names = []
    for prefix, part in model.every_part():
        if part.mechanism.linkage is not None:
            names += [f"{prefix}{name}" for name in joint_names(part.mechanism.linkage)]
        elif part.mechanism.kind == "slider_crank":
            names += [f"{prefix}{name}" for name in SLIDER_JOINTS]
    return tuple(names)


def couplings_of(model: MachineSpec) -> int:
    """Number of the couplings in the train."""
    return model.drive.stages.count("coupling")


def load_infos(parts: int, joints: int, couplings: int = 0) -> tuple[ResultInfo, ...]:
    """Every result of a machine with that many parts, joints and couplings, in the order of ``loads``."""
    infos = list(_WHOLE)
    for part in range(parts):
        infos += [_R(f"parts.{part}.{name}", unit, text) for name, unit, text in _OF_PART]
    for joint in range(joints):
        infos += [_R(f"joints.{joint}.force.{name}", unit, text) for name, unit, text in _OF_JOINT]
    for coupling in range(couplings):
        infos += [_R(f"couplings.{coupling}.{name}", unit, text) for name, unit, text in _OF_COUPLING]
    return tuple(infos)


def infos_of(model: MachineSpec) -> tuple[ResultInfo, ...]:
    """Every result of this machine, in the order of the columns of ``loads``."""
    return load_infos(len(model.every_part()), len(joints_of(model)), couplings_of(model))


def every_load_info() -> tuple[ResultInfo, ...]:
    """Those of a machine with as many parts, joints and couplings as one can have."""
    return load_infos(MAX_PARTS, MAX_JOINTS, MAX_STAGES)
