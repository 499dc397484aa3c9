"""The only part of the worker that imports the engine: a study and a range of cases in, plain arrays out.

Each model has its own module behind `Model`; the functions of this module look the model up by name. The numerical
kernels are imported where they are run, so reading a catalogue loads no compiler.
"""

from __future__ import annotations

import platform
from contextlib import suppress
from functools import cache
from typing import TYPE_CHECKING, Any

from sprag_study.engine import ENGINE_VERSION, Ending, Run, Span
from sprag_study.engine.catalogue import Parameter, ResultInfo
from sprag_study.engine.formulas.expressions import ExpressionError
from sprag_study.engine.machine_shaft.problems import AssemblyError, InsufficientInertiaError, TableError
from sprag_study.engine.outcome import (
    Basin,
    ClutchDuty,
    Duty,
    Engagement,
    Engagements,
    Portrait,
    Trajectory,
)
from sprag_study.engine.problems import MachineError
from sprag_study.engine.run import MEANS_FROM_PERIODS
from sprag_study.engine.sources import engine_folder, source_hash
from sprag_study.engine.vibration_drive.clutch import (
    ClutchFit,
    ClutchFitError,
    ClutchLaw,
    ClutchLawError,
    DegreeReport,
    check_law,
    fit_clutch,
)
from sprag_study.engine.vibration_drive.clutch import torque as clutch_torque
from sprag_study.engine.vibration_drive.measured_base import Reduction, reduce_motion, resolved_order
from sprag_study.engine.vibration_drive.parameters import (
    CLUTCH_COEFFICIENT,
    CLUTCH_WINDUP_LIMIT,
    HARMONIC_FACTOR,
    HARMONIC_PARAMETERS,
    HARMONICS,
    LOAD_FACTOR,
    LOAD_TABLE,
    LOAD_TABLE_SPEED,
    LOAD_TABLE_TORQUE,
    MAX_COEFFICIENTS,
    MAX_HARMONICS,
    MAX_LOAD_ROWS,
    MAX_PENDULUMS,
    ONLY_GIVEN,
    START_STATES,
)
from sprag_study.worker.models import machine_shaft, vibration_drive
from sprag_study.worker.models.abilities import (
    has_clutches,
    has_strobes,
    run_basin,
    run_duty,
    run_end_state,
    run_engagements,
    run_portrait,
)
from sprag_study.worker.models.common import (
    NO_PARAMETERS,
    ChunkResult,
    ChunkTask,
    Extent,
    FurtherRows,
    KernelShape,
    WorkerEnding,
)
from sprag_study.worker.models.model import Model
from sprag_study.worker.models.presentation import Panel, Presentation, Reference
from sprag_study.worker.models.quantities import Quantities, Quantity, numeric, with_quantities
from sprag_study.worker.models.registry import all_models, model_names, model_of, register, unregister
from sprag_study.worker.models.shares import SHARE, Share, with_shares
from sprag_study.worker.models.tasks import chunk_task, run_chunk, run_task
from sprag_study.worker.models.usable import half_width, unsettled, usable, usable_each, with_half_widths
from sprag_study.worker.models.vibration_drive import (
    NOT_SETTLED,
    WINDUP_OUT_OF_DATA,
    coefficients,
    duration_seconds,
    kernel_source,
    run_of,
)
from sprag_study.worker.models.vibration_drive.settled import (
    JUMPED,
    REGIME_SENTENCES,
    SETTLED,
    is_settled,
    settled_study,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from sprag_study.worker.study import Study

__all__ = [
    "CLUTCH_COEFFICIENT",
    "CLUTCH_WINDUP_LIMIT",
    "ENDING_SENTENCES",
    "ENGINE_VERSION",
    "HARMONICS",
    "HARMONIC_FACTOR",
    "HARMONIC_PARAMETERS",
    "JUMPED",
    "LOAD_FACTOR",
    "LOAD_TABLE",
    "LOAD_TABLE_SPEED",
    "LOAD_TABLE_TORQUE",
    "MACHINE_SHAFT",
    "MAX_COEFFICIENTS",
    "MAX_HARMONICS",
    "MAX_LOAD_ROWS",
    "MAX_PENDULUMS",
    "MEANS_FROM_PERIODS",
    "NOT_SETTLED",
    "NO_PARAMETERS",
    "OK",
    "ONLY_GIVEN",
    "REGIME_SENTENCES",
    "SETTLED",
    "SHARE",
    "START_STATES",
    "VIBRATION_DRIVE",
    "WINDUP_OUT_OF_DATA",
    "AssemblyError",
    "Basin",
    "ChunkResult",
    "ChunkTask",
    "ClutchDuty",
    "ClutchFit",
    "ClutchFitError",
    "ClutchLaw",
    "ClutchLawError",
    "DegreeReport",
    "Duty",
    "Ending",
    "Engagement",
    "Engagements",
    "ExpressionError",
    "Extent",
    "FurtherRows",
    "InsufficientInertiaError",
    "KernelShape",
    "MachineError",
    "Model",
    "Panel",
    "Parameter",
    "Portrait",
    "Presentation",
    "Quantities",
    "Quantity",
    "Reduction",
    "Reference",
    "ResultInfo",
    "Run",
    "Share",
    "Span",
    "TableError",
    "Trajectory",
    "WorkerEnding",
    "cache_folder",
    "cache_is_wanted",
    "can_sweep",
    "check_law",
    "chunk_task",
    "clutch_torque",
    "coefficients",
    "discard_compiled",
    "duration_seconds",
    "endings_of",
    "engine_folder",
    "estimate_compile_seconds",
    "estimate_seconds_per_case",
    "extent",
    "fit_clutch",
    "flags_of",
    "further_results",
    "half_width",
    "has_clutches",
    "has_strobes",
    "is_compiled",
    "is_settled",
    "kernel_source",
    "lanes_per_case",
    "load",
    "mark_of",
    "model_names",
    "model_of",
    "model_results",
    "numbered_by",
    "numeric",
    "parameter_catalogue",
    "parameters_of",
    "prepare",
    "presentation_of",
    "printed_symbol",
    "reduce_motion",
    "regime_info",
    "register",
    "resolved_order",
    "result_catalogue",
    "result_infos",
    "run_basin",
    "run_chunk",
    "run_duty",
    "run_end_state",
    "run_engagements",
    "run_of",
    "run_portrait",
    "run_task",
    "run_trajectory",
    "settled_study",
    "shape_of",
    "source_hash",
    "study_results",
    "table_of",
    "unregister",
    "unsettled",
    "usable",
    "usable_each",
    "variant_of",
    "variants",
    "warm_up",
    "with_half_widths",
    "with_quantities",
]

VIBRATION_DRIVE = vibration_drive.MODEL
MACHINE_SHAFT = machine_shaft.MODEL

register(vibration_drive.VibrationDrive())
register(machine_shaft.MachineShaft())

OK = Ending.OK.value


#: Every ending of a case, stored by its key, and its description for users.
ENDING_SENTENCES: dict[str, str] = {
    **{ending.value: ending.sentence for ending in Ending},
    WorkerEnding.CRASHED.value: (
        "The process that ran this case alone died twice: the case is not run again by itself and can be run again."
    ),
    WorkerEnding.TIMED_OUT.value: "The case, run alone, exceeded its time limit twice.",
    WorkerEnding.CANCELLED.value: "The study was cancelled before this case was run.",
    WorkerEnding.INVALID.value: (
        "The parameters drawn for this drive do not describe a machine: a derived parameter is out of its range, or "
        "the torque of a clutch is negative somewhere. The case was not run."
    ),
}


def endings_of(model: str) -> dict[str, str]:
    """The endings that a case of ``model`` can have, with their descriptions."""
    own = {OK, *model_of(model).endings, *WorkerEnding}
    return {name: sentence for name, sentence in ENDING_SENTENCES.items() if name in own}


def flags_of(model: str) -> dict[str, str]:
    """The flags that a case of ``model`` can have, with their descriptions."""
    return dict(model_of(model).flags)


def presentation_of(study: Study) -> Presentation:
    """The presentation of the model of ``study``."""
    return model_of(study.model).presentation_of(study)


def printed_symbol(text: str) -> tuple[str, str] | None:
    """Base and index of a symbol as in print; None where no model defines them."""
    found = (model.presentation.symbols.get(text) for model in all_models())
    return next(filter(None, found), None)


def parameter_catalogue(model: str) -> tuple[Parameter, ...]:
    """Every numeric parameter of ``model``: paths in a spec with placeholders.

    ``N`` is a pendulum, ``K`` a coefficient or a step, ``NAME`` a constant. The two entries of the clutch are listed
    under ``clutch.``; each pendulum may have them too (``pendulums.N.clutch.``). Raises ValueError for an unknown
    model.
    """
    return model_of(model).parameters()


def parameters_of(study: Study) -> dict[str, Parameter]:
    """The parameters of a study's own machine by flat path; empty where its model's catalogue is complete."""
    return model_of(study.model).parameters_of(study)


def variants(model: str) -> tuple[str, ...]:
    """The variants of ``model``, each with its own set of results."""
    return model_of(model).variants()


def variant_of(study: Study) -> str:
    """The variant of ``study``."""
    return model_of(study.model).variant_of(study)


def table_of(model: str, variant: str) -> str:
    """The variant of ``model`` whose table has the rows of this one."""
    return model_of(model).table_of(variant)


def further_results(study: Study) -> tuple[ResultInfo, ...]:
    """The results that ``study`` would have, besides its own, if its run had `loads`."""
    return model_of(study.model).further_results(study)


def result_infos(model: str, variant: str) -> tuple[ResultInfo, ...]:
    """Every result of that variant of ``model``, in the order of the columns of `ChunkResult.values`."""
    known = model_of(model)
    return with_shares(known.results(variant), known.presentation.shares)


def numbered_by(model: str, variant: str) -> str | None:
    """Result that numbers the rows of a case of that variant; None where a case has one row."""
    return model_of(model).numbered_by(variant)


def result_catalogue(model: str) -> tuple[ResultInfo, ...]:
    """Every result of ``model``, with placeholders as in `parameter_catalogue`."""
    return _result_catalogue(model_of(model))


@cache
def _result_catalogue(model: Model) -> tuple[ResultInfo, ...]:
    return with_shares(model.result_catalogue(), model.presentation.shares)


def model_results(study: Study) -> tuple[ResultInfo, ...]:
    """The results that the model of ``study`` gives, in the order of the columns of `ChunkResult.values`."""
    return result_infos(study.model, variant_of(study))


def study_results(study: Study) -> tuple[ResultInfo, ...]:
    """Every result of the cases of ``study``: those of its model, then its quantities."""
    return (*model_results(study), *(one.info for one in study.quantities))


def results_by_name(study: Study) -> dict[str, ResultInfo]:
    """Every result of the cases of ``study`` by its name."""
    return {info.name: info for info in study_results(study)}


def regime_info(infos: Sequence[ResultInfo]) -> ResultInfo | None:
    """The result that gives the kind of motion; None where there is none.

    Where there is one, ``regime.order`` is the number of excitation periods after which a motion repeats.
    """
    return next((info for info in infos if info.kind == "category"), None)


def shape_of(study: Study) -> KernelShape:
    """The kernel that the cases of ``study`` need."""
    return model_of(study.model).shape_of(study)


def extent(study: Study, case: int) -> Extent:
    """The independent variable of a case's instantaneous values: the time of its run, or the angle of its shaft."""
    return model_of(study.model).extent(study, case)


def run_trajectory(study: Study, case: int, start: float, end: float, points: int) -> Trajectory:
    """Instantaneous values of one case at ``points`` equally spaced points of its `extent`."""
    return model_of(study.model).trajectory(study, case, start, end, points)


def can_sweep(model: str, run: Mapping[str, Any]) -> bool:
    """Whether cases of ``model`` with that run can start from the settled motion of their neighbours."""
    return model_of(model).sweeps(run)


def lanes_per_case(study: Study) -> int:
    """Runs of the engine that one case of ``study`` takes side by side."""
    return model_of(study.model).lanes_per_case(study)


def estimate_seconds_per_case(study: Study) -> float:
    """Rough time of one case of ``study`` on one core, in s."""
    return model_of(study.model).estimate_seconds_per_case(study)


def estimate_compile_seconds(study: Study) -> float:
    """Rough time (s) to compile the kernel of ``study``; 0 where it is in the cache on disk."""
    shape = shape_of(study)
    return 0.0 if is_compiled(shape) else model_of(study.model).estimate_compile_seconds(shape)


def prepare() -> None:
    """Load the engine with its compiler, so that the first cases do not wait for that."""
    for model in all_models():
        model.prepare()


def load(shape: KernelShape) -> None:
    """Compile the kernel of that shape into the on-disk cache, or load it from there."""
    model_of(shape.model).load(shape)
    with suppress(OSError):
        mark_of(shape).touch()


def is_compiled(shape: KernelShape) -> bool:
    """Whether `load` has put the kernel of that shape into the on-disk cache, on this machine and for this engine."""
    return mark_of(shape).exists()


def mark_of(shape: KernelShape) -> Path:
    """The file beside the kernel of that shape in the cache that is there once it is compiled."""
    # Machines that share a home folder may need different code.
    return cache_folder() / f"{'-'.join(map(str, (shape.model, *shape.key, platform.node())))}.ready"


def warm_up(study: Study) -> None:
    """Compile the kernel that ``study`` needs into the on-disk cache, or load it from there."""
    load(shape_of(study))


def cache_folder() -> Path:
    """Folder of the compiled kernels; created if missing."""
    from sprag_study.engine.compile.cache import cache_folder as engine_cache_folder

    return engine_cache_folder()


def compiler() -> str:
    """The way in which this process compiles kernels."""
    from sprag_study.engine.compile.ways import WAY

    return WAY


def discard_compiled() -> None:
    """Delete every compiled kernel of this engine from the cache on disk, because some may be damaged."""
    from sprag_study.engine.compile.cache import discard

    discard()


def cache_is_wanted() -> bool:
    """Whether that folder is the configured one, not the substitute for an unwritable one."""
    from sprag_study.engine.compile.cache import is_wanted

    return is_wanted(cache_folder())
