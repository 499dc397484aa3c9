"""The model of machine shafts: turns a study's structure and columns into a call of its engine."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from functools import cache
from itertools import product
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, cast, get_args

import numpy as np

from sprag_study.engine import Ending
from sprag_study.engine.machine_shaft.elements import ELEMENT_KINDS, Element, LinkageChoice
from sprag_study.engine.machine_shaft.load_results import couplings_of, every_load_info, infos_of, joints_of, load_infos
from sprag_study.engine.machine_shaft.parameters import parameters as _engine_parameters
from sprag_study.engine.machine_shaft.results import result_infos
from sprag_study.engine.machine_shaft.spec import (
    LINKED,
    REVOLUTIONS,
    Drive,
    Flywheel,
    MachineSpec,
    MechanismChoice,
    MechanismKind,
    OperationChoice,
    PartChoice,
    Stage,
)
from sprag_study.worker.models.common import (
    ChunkResult,
    ChunkTask,
    Extent,
    KernelShape,
    case_machine,
    chunk_result,
    has_loads,
)
from sprag_study.worker.models.machine_shaft.presentation import PRESENTATION, presentation_of
from sprag_study.worker.models.model import Model

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import ArrayLike, NDArray

    from sprag_study.engine.catalogue import Parameter, ResultInfo
    from sprag_study.engine.machine_shaft.sketch import Sketch
    from sprag_study.engine.machine_shaft.steady_cycles import SteadyCycles
    from sprag_study.engine.machine_shaft.transient_course import Course, Transient
    from sprag_study.engine.outcome import Trajectory
    from sprag_study.worker.models.model import Speeds, Transients
    from sprag_study.worker.models.presentation import Presentation
    from sprag_study.worker.study import Study

MODEL = "machine-shaft"
STAGE_KINDS: tuple[str, ...] = get_args(Stage)
#: All machines share their compiled code.
SHAPE = KernelShape(MODEL)
Structure = dict[str, Any]


def spec_of(structure: Mapping[str, Any] | None) -> MachineSpec:
    """The engine's structure from a study's plain data."""
    if structure is None:
        raise ValueError("a machine shaft needs its structure")
    return MachineSpec.from_json(structure)


@cache
def catalogue() -> tuple[Parameter, ...]:
    """Every parameter of any machine, with ``K`` for the number of a step and ``NAME`` for the name of a constant.

    Each part of a machine of several has the parameters of mechanisms and operations under ``parts.N.``. Where the unit
    depends on the machine, it is that of a force or of the shaft's angle.
    """
    kinds: tuple[MechanismKind, ...] = tuple(kind for kind in get_args(MechanismKind) if kind in LINKED)
    every: list[MachineSpec] = [MachineSpec(cycle=max(REVOLUTIONS), constants=("NAME",))]
    every += [MachineSpec(drive=Drive("formula")), MachineSpec(balance="motor", drive=Drive(motor="linear"))]
    every += [MachineSpec(balance="motor", drive=Drive(motor=motor)) for motor in ("kloss", "table")]
    every += [MachineSpec(drive=Drive(flywheel=shape)) for shape in get_args(Flywheel)]
    every += [MachineSpec(drive=Drive(stages=(stage,))) for stage in get_args(Stage)]
    every += [MachineSpec(mechanism=MechanismChoice(kind)) for kind in kinds]
    every += [MachineSpec(mechanism=MechanismChoice("four_bar", weights="all"))]
    elements = (LinkageChoice((Element(kind, "X"),)) for kind in ELEMENT_KINDS)
    every += [MachineSpec(mechanism=MechanismChoice("linkage", linkage=own)) for own in elements]
    forms = (
        OperationChoice("force"),
        OperationChoice("force", "steps", steps=1),
        OperationChoice("gas"),
        OperationChoice("pressure"),
    )
    every += [MachineSpec(cycle=max(REVOLUTIONS), operation=form) for form in forms]
    every += [MachineSpec(parts=(PartChoice(),))]
    found: dict[str, Parameter] = {}
    for spec in every:
        for entry in _engine_parameters(spec):
            path = entry.path.replace(".steps.0.", ".steps.K.").replace(".stages.0.", ".stages.K.")
            path = path.replace(".elements.0.", ".elements.K.")
            path = path.replace("parts.0.", "parts.N.")
            found.setdefault(path, replace(entry, path=path, help=entry.help + REMARKS.get(path, "")))
    shaft = ("mean_speed", "wanted_irregularity", "friction_torque", "gravity", "drive")
    order = (*shaft, "mechanism", "operation", "parts", "constants")
    return tuple(sorted(found.values(), key=lambda entry: order.index(entry.path.split(".")[0])))


_OF_FORCE = "; N*m for a torque"
_OF_ANGLE = "; a fraction from 0 to 1 over the stroke, else no further than the cycle"
REMARKS = {
    "mechanism.four_bar.inclination": '; with `weights` "all"',
    "operation.value": _OF_FORCE,
    "operation.steps.K.value": _OF_FORCE,
    "operation.steps.K.from": _OF_ANGLE,
    "operation.steps.K.to": _OF_ANGLE,
    "drive.inertia": "; required without stages and flywheel",
    "drive.torque": "; at the motor where there are stages",
    "drive.stages.K.radius": "; required for a rack",
}


def parameters_of(structure: Mapping[str, Any]) -> dict[str, Parameter]:
    """Every numeric parameter of a machine of this structure, by path."""
    # Rows of tables are not parameters.
    bare = _without_tables(structure)
    if "parts" in structure:
        bare["parts"] = [_without_tables(part) for part in structure["parts"]]
    return dict(_parameters(json.dumps(bare, sort_keys=True)))


def _without_tables(structure: Mapping[str, Any]) -> Structure:
    return {name: {**part, "table": None} if isinstance(part, dict) else part for name, part in structure.items()}


@cache
def _parameters(structure: str) -> dict[str, Parameter]:
    return {entry.path: entry for entry in _engine_parameters(spec_of(json.loads(structure)))}


def check_structure(structure: Mapping[str, Any]) -> None:
    """Raise MachineError where the structure is not a valid machine."""
    from sprag_study.engine.machine_shaft.machine import check_structure as engine_check

    engine_check(spec_of(structure))


def check(structure: Mapping[str, Any], values: Mapping[str, float]) -> Ending:
    """The ending of the machine, ok or unstable; raise MachineError, with the reason, where it has no steady motion."""
    from sprag_study.engine.machine_shaft.checked import check as engine_check

    return engine_check(spec_of(structure), values)


def other_speed(structure: Mapping[str, Any], values: Mapping[str, float]) -> float:
    """A further speed in rad/s at which the shaft may turn steadily; NaN for none."""
    from sprag_study.engine.machine_shaft.steady_cycles import other_speed as engine_other_speed

    return engine_other_speed(spec_of(structure), values)


def base_results(structure: Mapping[str, Any], values: Mapping[str, float]) -> dict[str, float]:
    """Results of the machine with these numbers, by name; NaN for missing ones."""
    from sprag_study.engine.machine_shaft.simulate import simulate

    found = simulate(spec_of(structure), values, cases=1).values[0]
    return {info.name: float(value) for info, value in zip(result_infos(), found, strict=True)}


def reachable_pressure(suction: ArrayLike, clearance: ArrayLike, exponent: ArrayLike) -> NDArray[np.float64]:
    """Largest pressure (Pa) that a compressor reaches."""
    from sprag_study.engine.machine_shaft.operations import reachable_pressure as engine_pressure

    return engine_pressure(*(np.asarray(part, dtype=np.float64) for part in (suction, clearance, exponent)))


def sketches_of(
    structure: Mapping[str, Any], values: Mapping[str, float], angles: NDArray[np.float64]
) -> tuple[Sketch, ...]:
    """Each mechanism at angles of the shaft (rad)."""
    from sprag_study.engine.machine_shaft.sketches import sketches

    return sketches(spec_of(structure), values, angles)


def joints_in(structure: Mapping[str, Any] | None) -> tuple[str, ...]:
    """The joints of a machine whose forces are results of studies with `loads`, in the order of their numbers."""
    return joints_of(spec_of(structure))


#: Variant of the studies with loads of machines with the most parts, joints and couplings; others begin with it.
_LOADS_VARIANT: Final = "loads"


def _variant(spec: MachineSpec) -> str:
    """With the numbers of parts and joints, and of couplings where there are any."""
    counts = [len(spec.every_part()), len(joints_of(spec)), couplings_of(spec)]
    return "-".join([_LOADS_VARIANT, *map(str, counts if counts[2] else counts[:2])])


@cache
def _results(variant: str) -> tuple[ResultInfo, ...]:
    if not variant:
        return result_infos()
    if variant == _LOADS_VARIANT:
        return (*result_infos(), *every_load_info())
    return (*result_infos(), *load_infos(*map(int, variant.split("-")[1:])))


class MachineShaft(Model):
    """A shaft that a drive turns steadily against a mechanism and its resistance, over one cycle.

    Studies with loads have a variant for each number of parts, joints and couplings; all of them share one table.
    """

    name = MODEL
    endings = frozenset(
        {
            Ending.INERTIA_INSUFFICIENT,
            Ending.UNBALANCED_WORK,
            Ending.CANNOT_ASSEMBLE,
            Ending.NEGATIVE_INERTIA,
            Ending.MOTOR_STALLED,
            Ending.QUADRATURE_NOT_REACHED,
            Ending.MOTOR_OVERRUN,
            Ending.NEAR_SINGULAR,
            Ending.UNSTABLE,
        }
    )
    #: What the shaft needs in order to turn, which is asked where it does not.
    without_motion = MappingProxyType(
        {
            Ending.INERTIA_INSUFFICIENT: frozenset(
                {
                    "least_mean_speed", "required_inertia", "required_inertia.energy", "flywheel.required_mass",
                    "flywheel.required_diameter",
                }
            )
        }
    )  # fmt: skip
    presentation = PRESENTATION

    def presentation_of(self, study: Study) -> Presentation:
        """With the results of its flywheel, motor and couplings among the main ones."""
        return presentation_of(study.structure or {}, {*study.base, *study.column_paths})

    def parameters(self) -> tuple[Parameter, ...]:
        return catalogue()

    def parameters_of(self, study: Study) -> dict[str, Parameter]:
        return {} if study.structure is None else parameters_of(study.structure)

    def variants(self) -> tuple[str, ...]:
        return ("", _LOADS_VARIANT)

    def variant_of(self, study: Study) -> str:
        return _variant(spec_of(study.structure)) if has_loads(study.run) else ""

    def table_of(self, variant: str) -> str:
        return _LOADS_VARIANT if variant else ""

    def results(self, variant: str) -> tuple[ResultInfo, ...]:
        return _results(variant)

    def further_results(self, study: Study) -> tuple[ResultInfo, ...]:
        return () if has_loads(study.run) else infos_of(spec_of(study.structure))

    def joints(self, study: Study) -> tuple[str, ...]:
        return joints_in(study.structure) if has_loads(study.run) else ()

    def result_catalogue(self) -> tuple[ResultInfo, ...]:
        named = (
            (info, re.sub(r"^(joints|couplings)\.0\.", r"\1.K.", info.name.replace("parts.0.", "parts.N.")))
            for info in load_infos(1, 1, 1)
        )
        return (*result_infos(), *(replace(info, name=name) for info, name in named))

    def shape_of(self, study: Study) -> KernelShape:
        return SHAPE

    def run(self, task: ChunkTask) -> ChunkResult:
        from sprag_study.engine.machine_shaft.simulate import simulate

        own = has_loads(task.run)
        batch = simulate(spec_of(task.structure), task.columns, cases=task.count, with_loads=own)
        return chunk_result(task.first, batch.endings, [""] * task.count, batch.values)

    def extent(self, study: Study, case: int) -> Extent:
        """The cycle of the shaft."""
        cycle = 2.0 * math.pi * spec_of(study.structure).cycle
        return Extent("angle", "rad", cycle, cycle)

    def trajectory(self, study: Study, case: int, start: float, end: float, points: int) -> Trajectory:
        """Tables over ``points`` equally spaced angles of the shaft from ``start`` to ``end`` (rad)."""
        from sprag_study.engine.machine_shaft.trajectory import trajectory

        columns = case_machine(study, case)
        return trajectory(spec_of(study.structure), columns, np.linspace(start, end, points))

    @property
    def transients(self) -> Transients:
        return _Transients()

    @property
    def speeds(self) -> Speeds:
        return _Speeds()

    def estimate_seconds_per_case(self, study: Study) -> float:
        from sprag_study.engine.machine_shaft.estimate import estimate_seconds

        return estimate_seconds(spec_of(study.structure), with_loads=has_loads(study.run))

    def estimate_compile_seconds(self, shape: KernelShape) -> float:
        """On one core, with the enclosures of formulas."""
        return 10.0

    def prepare(self) -> None:
        import sprag_study.engine.machine_shaft.simulate  # noqa: F401

    def load(self, shape: KernelShape) -> None:
        if shape.key:
            _run_a_transient()
        else:
            _run_each_kind()

    def known_answers(self, shape: KernelShape) -> bytes:
        return _run_a_transient() if shape.key else _run_each_kind()


class _Transients:
    def has_motor(self, study: Study) -> bool:
        return (study.structure or {}).get("balance") == "motor"

    def shape(self, study: Study) -> KernelShape:
        return KernelShape(study.model, ("transient",))

    def run(self, study: Study, case: int, course: Course, points: int) -> Transient:
        from sprag_study.engine.machine_shaft.transients import transient

        return transient(spec_of(study.structure), case_machine(study, case), course, points)


class _Speeds:
    def has(self, study: Study) -> bool:
        """With a motor, or with a formula of a load that uses ``omega``, unless a constant stands for the loads."""
        spec = spec_of(study.structure)
        if spec.balance == "motor" or (spec.balance == "constant" and spec.balance_side == "operation"):
            return spec.balance == "motor"
        formulas = (part.operation.formula for _, part in spec.every_part() if part.operation.form == "formula")
        return "omega" not in spec.constants and any(re.search(r"\bomega\b", text or "") for text in formulas)

    def run(self, study: Study, case: int, load: float) -> SteadyCycles:
        from sprag_study.engine.machine_shaft.steady_cycles import steady_cycles

        found = steady_cycles(spec_of(study.structure), case_machine(study, case), load)
        if found is None:
            raise ValueError("no torque of the machine follows the speed")
        return found


def _run_each_kind() -> bytes:
    """Run a case of each kind, which compiles what all machines share; returns their results."""
    from sprag_study.engine.machine_shaft.simulate import simulate
    from sprag_study.engine.machine_shaft.trajectory import trajectory

    found = []
    for mean, balance in product(("midrange", "angle", "time"), ("scale", "motor")):
        spec = MachineSpec(
            mean_speed_is=cast("Any", mean), balance=cast("Any", balance),
            drive=Drive("formula", formula="2 + cos(phi)", motor="linear", stages=("coupling",)),
            mechanism=MechanismChoice("formula", formula="1 + 0.1*sin(phi)^2"),
            operation=OperationChoice("torque", "formula", formula="1 + sin(phi)"),
        )  # fmt: skip
        numbers = {"drive.inertia": 1.0, "drive.stages.0.inertia": 0.1, "drive.stages.0.stiffness": 100.0}
        if balance == "motor":
            numbers |= {"drive.motor.no_load_speed": 10.0, "drive.motor.stall_torque": 20.0}
        else:
            numbers |= {"mean_speed": 10.0, "wanted_irregularity": 0.01}
        found.append(simulate(spec, numbers, cases=2).values.tobytes())
        found.append(trajectory(spec, numbers, [0.0, 1.0]).values.tobytes())
    return b"".join(found)


def _run_a_transient() -> bytes:
    """Run a short transient, which compiles what all of them share; returns its motion."""
    from sprag_study.engine.machine_shaft.transient_course import Course
    from sprag_study.engine.machine_shaft.transients import transient

    numbers = {"drive.inertia": 1.0, "drive.motor.no_load_speed": 10.0, "drive.motor.stall_torque": 20.0}
    spec = MachineSpec(balance="motor", drive=Drive(motor="linear"))
    return transient(spec, numbers, Course("run-up", within=0.5), 2).motion.values.tobytes()
