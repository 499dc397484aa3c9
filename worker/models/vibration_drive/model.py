"""The model of vibration drives: turns a study's columns into a call of its engine."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

import numpy as np

from sprag_study.engine import Ending, Run, Span
from sprag_study.engine.catalogue import ResultInfo
from sprag_study.engine.vibration_drive.cases import harmonic_room, has_curve, has_drag, has_table
from sprag_study.engine.vibration_drive.clutch import ClutchLawError, check_law
from sprag_study.engine.vibration_drive.load_results import load_infos
from sprag_study.engine.vibration_drive.parameters import (
    CLUTCH_COEFFICIENT,
    CLUTCH_WINDUP_LIMIT,
    CYCLIC,
    HARMONIC_PARAMETERS,
    HARMONICS,
    LOAD_TABLE,
    LOAD_TABLE_SPEED,
    LOAD_TABLE_TORQUE,
    MAX_PENDULUMS,
    PARAMETERS,
)
from sprag_study.engine.vibration_drive.regimes import Regime, depends_on_history, settled_infos
from sprag_study.engine.vibration_drive.results import result_infos
from sprag_study.engine.vibration_drive.start_results import NUMBER, started_infos
from sprag_study.worker.models.common import (
    ChunkResult,
    ChunkTask,
    Extent,
    FurtherRows,
    KernelShape,
    case_machine,
    chunk_result,
    has_loads,
)
from sprag_study.worker.models.model import Model
from sprag_study.worker.models.starts import count_of, further_starts, has_starts
from sprag_study.worker.models.vibration_drive.branches import branch_of, branch_results
from sprag_study.worker.models.vibration_drive.loads import (
    loads_seconds,
    with_loads,
    with_loads_of_starts,
    with_settled_loads,
)
from sprag_study.worker.models.vibration_drive.presentation import PRESENTATION
from sprag_study.worker.models.vibration_drive.sections import sections_of
from sprag_study.worker.models.vibration_drive.settled import (
    HISTORY_DEPENDENT,
    HISTORY_FLAGS,
    REGIME_FLAGS,
    SENSITIVE_START,
    START_FLAGS,
    SWEEP_FLAGS,
    followed_periods,
    is_settled,
    mean_periods,
    settings_of,
    settled_study,
    swings,
)
from sprag_study.worker.models.vibration_drive.swept import start_of, swept
from sprag_study.worker.models.vibration_drive.turns import turn_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from numpy.typing import NDArray

    from sprag_study.engine.catalogue import Parameter
    from sprag_study.engine.outcome import Basin, Duty, Engagements, Portrait, Trajectory
    from sprag_study.engine.run import Reset, Unit
    from sprag_study.engine.vibration_drive.examined import Examined
    from sprag_study.worker.models.branches import Along, CaseBranch
    from sprag_study.worker.models.forces import Bearing, Forces
    from sprag_study.worker.models.model import Clutches, Reactions, StartUps, Strobes
    from sprag_study.worker.models.ramps import Ramps, StartUp
    from sprag_study.worker.models.sections import CaseSections, Sampling
    from sprag_study.worker.models.turns import CaseTurn
    from sprag_study.worker.study import Study

MODEL = "vibration-drive"

#: Flag of a case with a clutch that worked beyond the end of the measured data.
WINDUP_OUT_OF_DATA = "windup_out_of_data"
#: Flag of a case whose window does not show the settled motion.
NOT_SETTLED = "not_settled"
FLAG_SENTENCES: dict[str, str] = {
    NOT_SETTLED: (
        "The motion had not settled in the window: the settled mean speed (or, with the shaft held, the swing of a "
        "pendulum) differs by more than 1 %. Results are not those of steady running."
    ),
    WINDUP_OUT_OF_DATA: "A clutch was wound up beyond the measured data, where its law was extrapolated linearly.",
    **REGIME_FLAGS,
    **HISTORY_FLAGS,
    **START_FLAGS,
    **SWEEP_FLAGS,
}
#: Most cases whose frequency is evaluated for an estimate.
_SPREAD = 1_000
#: Suffixes of the variants of settled studies, of those with starts, and of those with forces and duty, after the
#: number of pendulums.
_SETTLED_VARIANT, _STARTS_VARIANT, _LOADS_VARIANT = "-settled", "-starts", "-loads"
_INFOS: Final[dict[str, Callable[[int], tuple[ResultInfo, ...]]]] = {
    "": result_infos, _SETTLED_VARIANT: settled_infos, _STARTS_VARIANT: started_infos,
}  # fmt: skip


@cache
def _results(variant: str) -> tuple[ResultInfo, ...]:
    plain = variant.removesuffix(_LOADS_VARIANT)
    number, dash, kind = plain.partition("-")
    infos = _INFOS[f"{dash}{kind}"](int(number))
    return infos if plain == variant else (*infos, *load_infos(int(number)))


#: A drive whose known answers show all phases of its motion.
_DRIVEN: Final = {
    "excitation.frequency": 28.6, "excitation.amplitude_x": 1.7e-3, "excitation.amplitude_y": 1.7e-3,
    "shaft.inertia": 2e-3, "shaft.load": 0.3,
}  # fmt: skip
_PENDULUM_OF_IT: Final = {
    "inertia": 1e-3, "mass": 0.5, "arm": 0.03, "spring_rate": 9000.0, "spring_arm": 0.05, "damping": 0.01,
    "backlash": 0.005,
}  # fmt: skip

_DRAG_OF_IT: Final = {"shaft.bearing_damping": 1e-3, "shaft.quadratic_load": 1e-5}
_CURVE_OF_IT: Final = {
    "shaft.stribeck_load": 0.1, "shaft.stribeck_speed": 2.0, "shaft.cyclic_load": 0.5, "shaft.load_cycles": 8.0,
}  # fmt: skip
_TABLE_OF_IT: Final = {
    f"{LOAD_TABLE}{k}.{name}": value
    for k, row in enumerate(((0.0, 0.1), (5.0, 0.05), (12.0, 0.2)))
    for name, value in zip(("speed", "torque"), row, strict=True)
}
_HARMONIC_OF_IT: Final = {"order": 2.0, "amplitude_x": 2e-4, "phase_x": 0.5, "amplitude_y": 1e-4, "phase_y": 1.0}
_DRAG_OF_CLUTCHES: Final = {"clutch_damping": 0.05, "overrunning_damping": 1e-4}

_PENDULUM = re.compile(r"pendulums\.(\d+)\.")
_COEFFICIENT = re.compile(r"(?:^|\.)clutch\.coefficients\.(\d+)$")


#: Last part of the key of a kernel with torques that depend on speeds, of one with loads that are no polynomials of
#: them too, of one with loads that are tables over them besides, and of one with ramps of excitation and load.
_DRAG: Final = "drag"
_CURVE: Final = "curve"
_TABLE: Final = "table"
_RAMP: Final = "ramp"


class DriveKey(NamedTuple):
    """Key of the kernel of a vibration drive; ``drag``: with torques that depend on speeds, ``curved``: with loads that
    are no polynomials of the speed too, ``tabled``: with loads that are tables over it besides; ``harmonics``: with
    room for as many harmonics of the base, a number that then ends the key; ``ramped``: with ramps.
    """

    pendulums: int
    coefficients: int
    tolerance: float
    drag: bool = False
    curved: bool = False
    tabled: bool = False
    harmonics: int = 0
    ramped: bool = False

    @property
    def shape(self) -> KernelShape:
        """The shape with this key."""
        terms: tuple[str, ...] = (
            (_TABLE,) if self.tabled else (_CURVE,) if self.curved else (_DRAG,) if self.drag else ()
        )
        terms += (_RAMP,) if self.ramped else ()
        room = (self.harmonics,) if self.harmonics else ()
        return KernelShape(MODEL, (*self[:3], *terms, *room))


def _paths(study: Study) -> Iterable[str]:
    yield from study.base
    for axis in study.axes:
        yield from axis.paths


def pendulums(study: Study) -> int:
    """Number of pendulums of the machine: one more than the largest index in the study's paths."""
    return 1 + max(int(match[1]) for path in _paths(study) if (match := _PENDULUM.match(path)))


def coefficients(study: Study) -> int:
    """Number of coefficients of the longest clutch law of the study."""
    return 1 + max((int(match[1]) for path in _paths(study) if (match := _COEFFICIENT.search(path))), default=0)


def _span(value: object) -> Span:
    number, unit = cast("tuple[float, Unit]", value)
    return Span(float(number), unit)


def run_of(run: Mapping[str, Any]) -> Run:
    """The engine's settings of the run, from the plain data of a study.

    For a settled run: those of a timed run of its largest duration.
    """
    window = cast("list[object] | None", run.get("window"))
    return Run(
        duration=Span(float(run["at_most"])) if is_settled(run) else _span(run["duration"]),
        window=None if window is None else (_span(window[0]), _span(window[1])),
        tolerance=float(cast("float", run["tolerance"])),
        reset=cast("Reset", run["reset"]),
    )


def _flags(
    infos: Iterable[ResultInfo],
    values: NDArray[np.float64],
    *,
    not_settled: NDArray[np.bool_] | None = None,
    sensitive: NDArray[np.bool_] | None = None,
) -> list[str]:
    """Flags of every case, joined by commas; ``not_settled`` of runs of a given time, ``sensitive`` of settled motions
    whose starts were examined.
    """
    column = {info.name: values[:, index] for index, info in enumerate(infos)}
    beyond = np.column_stack([values for name, values in column.items() if name.endswith(".fraction.beyond_data")])
    raised = {WINDUP_OUT_OF_DATA: np.any(beyond > 0.0, axis=1)}
    if "regime" in column:
        raised |= {flag: column["regime"] == Regime[flag.upper()] for flag in REGIME_FLAGS}
        raised[HISTORY_DEPENDENT] = depends_on_history(column)
    if sensitive is not None:
        raised[SENSITIVE_START] = sensitive
    if not_settled is not None:
        raised = {NOT_SETTLED: not_settled, **raised}
    return [",".join(name for name, cases in raised.items() if cases[case]) for case in range(len(values))]


def duration_seconds(study: Study, case: int) -> float:
    """Duration of the run of one case, in s."""
    duration = run_of(study.run).duration
    return duration.value if duration.unit == "s" else duration.value / _frequency(study, case)


def _frequency(study: Study, case: int) -> float:
    return case_machine(study, case)["excitation.frequency"]


def _mean_periods(study: Study) -> float:
    """Computed excitation periods per case, averaged over the study."""
    if is_settled(study.run):
        return mean_periods(study.run) * count_of(study.run)
    periods = run_of(study.run).duration.in_periods(float(np.mean(_frequencies(study))))
    return periods + followed_periods(periods)


def _examined_periods(study: Study) -> float:
    """Excitation periods of a case that forces and duty examine in a run of a given time; 0 for settled motion."""
    if is_settled(study.run) or not has_loads(study.run):
        return 0.0
    from sprag_study.engine.vibration_drive.examined import examined_window

    start, end = examined_window(run_of(study.run), float(np.mean(_frequencies(study))))
    return end - start


def _frequencies(study: Study) -> NDArray[np.float64]:
    """Excitation frequencies of the study, Hz; where they are derived, those of cases evenly spread over it."""
    if "excitation.frequency" in study.derive:
        cases = np.linspace(0, study.cases - 1, min(study.cases, _SPREAD), dtype=np.int64)
        return study.columns(cases)["excitation.frequency"]
    for axis in study.axes:
        if "excitation.frequency" in axis.paths:
            return axis.array
    return np.array([study.base["excitation.frequency"]])


def kernel_source(pendulums: int, coefficients: int, tolerance: float) -> str:
    """Generated source of the kernel of that shape for this machine; nothing is compiled."""
    from sprag_study.engine.vibration_drive.kernel import lane_count, order_for, source
    from sprag_study.engine.vibration_drive.layout import make_layout

    return source(make_layout(pendulums, coefficients, order_for(tolerance), lane_count()))


class VibrationDrive(Model):
    """Pendulums on a vibrating base that turn a shaft through freewheels.

    There are two variants for each number of pendulums: studies of settled motion, and of a given time.
    """

    name = MODEL
    endings = frozenset({Ending.ACCURACY_NOT_REACHED, Ending.CHATTER, Ending.STEP_BUDGET, Ending.DIVERGED})
    flags = FLAG_SENTENCES
    unsettled = frozenset({NOT_SETTLED, Regime.UNSETTLED.name.lower()})
    presentation = PRESENTATION

    def parameters(self) -> tuple[Parameter, ...]:
        return (
            *PARAMETERS,
            LOAD_TABLE_SPEED,
            LOAD_TABLE_TORQUE,
            *HARMONIC_PARAMETERS,
            CLUTCH_COEFFICIENT,
            CLUTCH_WINDUP_LIMIT,
        )

    def variants(self) -> tuple[str, ...]:
        return tuple(
            f"{number}{kind}{further}"
            for further in ("", _LOADS_VARIANT)
            for kind in _INFOS
            for number in range(1, MAX_PENDULUMS + 1)
        )

    def variant_of(self, study: Study) -> str:
        kind = _STARTS_VARIANT if has_starts(study.run) else _SETTLED_VARIANT if is_settled(study.run) else ""
        return f"{pendulums(study)}{kind}{_LOADS_VARIANT if has_loads(study.run) else ''}"

    def results(self, variant: str) -> tuple[ResultInfo, ...]:
        return _results(variant)

    def further_results(self, study: Study) -> tuple[ResultInfo, ...]:
        return () if has_loads(study.run) else load_infos(pendulums(study))

    def numbered_by(self, variant: str) -> str | None:
        return NUMBER if variant.removesuffix(_LOADS_VARIANT).endswith(_STARTS_VARIANT) else None

    def result_catalogue(self) -> tuple[ResultInfo, ...]:
        # One pendulum represents all.
        one = "pendulums.0."
        infos = (*started_infos(1), *load_infos(1))
        return tuple(replace(info, name=info.name.replace(one, "pendulums.N.")) for info in infos)

    def shape_of(self, study: Study) -> KernelShape:
        terms = {
            "drag": has_drag(_paths(study)), "curved": has_curve(_paths(study)), "tabled": has_table(_paths(study)),
        }  # fmt: skip
        room = harmonic_room(_paths(study))
        numbers = pendulums(study), coefficients(study), run_of(study.run).tolerance
        return DriveKey(*numbers, **terms, harmonics=room).shape

    def sweeps(self, run: Mapping[str, Any]) -> bool:
        return is_settled(run) and not has_starts(run)

    def invalid(self, study: Study, columns: Mapping[str, Any], count: int) -> NDArray[np.bool_]:
        """The cases with a clutch whose torque is negative somewhere in its range, or zero everywhere; and those with a
        cyclic load where motion is to settle.
        """
        found = np.zeros(count, dtype=np.bool_)
        if is_settled(study.run):
            found |= np.broadcast_to(np.asarray(columns.get(CYCLIC, 0.0)) > 0.0, count)
        paths = [path for path in columns if ".coefficients." in f".{path}"]
        for prefix in dict.fromkeys(path.partition("coefficients.")[0] for path in paths):
            limit = columns.get(f"{prefix}windup_limit", np.inf)
            law = [columns[f"{prefix}coefficients.{k}"] for k in range(sum(path.startswith(prefix) for path in paths))]
            if not any(isinstance(part, np.ndarray) for part in (limit, *law)):
                continue  # the same in all cases, and checked with the spec
            found |= _not_laws(np.column_stack([np.broadcast_to(part, count) for part in (limit, *law)]))
        return found

    def run(self, task: ChunkTask) -> ChunkResult:
        from sprag_study.engine.vibration_drive.settle import settle
        from sprag_study.engine.vibration_drive.transients import simulate_judged

        number = _key_of(task.shape).pendulums
        if has_starts(task.run):
            return _run_starts(task, number)
        if task.lines is not None:
            return swept(task, lambda values: _flags(settled_infos(number), values))
        if is_settled(task.run):
            settled = settle(task.columns, settings_of(task.run), cases=task.count, examine_starts=True)
            flags = _flags(settled_infos(number), settled.values, sensitive=settled.sensitive)
            return chunk_result(task.first, settled.endings, flags, with_settled_loads(task, settled))
        judged = simulate_judged(task.columns, run_of(task.run), cases=task.count)
        batch, flags = judged.batch, _flags(result_infos(number), judged.batch.values, not_settled=judged.off)
        return chunk_result(task.first, batch.endings, flags, with_loads(task, batch, run_of(task.run)))

    def extent(self, study: Study, case: int) -> Extent:
        """The run of one case; its periods are those of the excitation.

        For a settled study, the longest run of its search; the settled motion is at its end.
        """
        end, period = duration_seconds(study, case), 1.0 / _frequency(study, case)
        begin = end - study.run["max_period"] * period if is_settled(study.run) else 0.0
        return Extent("time", "s", end, period, begin)

    def trajectory(self, study: Study, case: int, start: float, end: float, points: int) -> Trajectory:
        """Instantaneous values at ``points`` equally spaced times from ``start`` to ``end`` (s)."""
        from sprag_study.engine.vibration_drive.simulate import trajectory

        columns = case_machine(study, case)
        return trajectory(columns, run_of(study.run), np.linspace(start, end, points), start_of(study, case))

    @property
    def clutches(self) -> Clutches:
        return _Clutches()

    @property
    def reactions(self) -> Reactions:
        return _Reactions()

    @property
    def strobes(self) -> Strobes:
        return _Strobes()

    @property
    def start_ups(self) -> StartUps:
        return _StartUps()

    def lanes_per_case(self, study: Study) -> int:
        return count_of(study.run)

    def estimate_seconds_per_case(self, study: Study) -> float:
        from sprag_study.engine.vibration_drive.simulate import estimate_seconds

        period = float(np.mean(1.0 / _frequencies(study)))
        key = _key_of(self.shape_of(study))
        seconds = estimate_seconds(key.pendulums, key.coefficients, key.tolerance, _mean_periods(study), period)
        return seconds + loads_seconds(study.run, key.pendulums, _examined_periods(study))

    def estimate_compile_seconds(self, shape: KernelShape) -> float:
        """On one core: 7 s for the kernel of one pendulum, 13 s for eight; 3.7 s for the search of settled motions."""
        return 10.7 + 0.9 * (_key_of(shape).pendulums - 1)

    def prepare(self) -> None:
        import sprag_study.engine.vibration_drive.simulate  # noqa: F401

    def load(self, shape: KernelShape) -> None:
        from sprag_study.engine.vibration_drive.simulate import warm_up

        warm_up(*_key_of(shape))

    def known_answers(self, shape: KernelShape) -> bytes:
        from sprag_study.engine.vibration_drive.simulate import simulate

        pendulums, coefficients, tolerance, drag, curved, tabled, harmonics, ramped = _key_of(shape)
        columns = _DRIVEN | (_DRAG_OF_IT if drag else {}) | (_CURVE_OF_IT if curved else {})
        columns |= _TABLE_OF_IT if tabled else {}
        for number in range(harmonics):
            columns |= {f"{HARMONICS}{number}.{name}": value for name, value in _HARMONIC_OF_IT.items()}
            columns[f"{HARMONICS}{number}.order"] = 2.0 + number
        swinging = _PENDULUM_OF_IT | (_DRAG_OF_CLUTCHES if drag else {})
        for number in range(pendulums):
            columns |= {f"pendulums.{number}.{name}": value for name, value in swinging.items()}
        columns |= {f"clutch.coefficients.{k}": 200.0 for k in range(max(1, coefficients))}
        if ramped:
            from sprag_study.engine.vibration_drive.start_up import ramp_answers

            return ramp_answers(columns, tolerance)
        run = Run(duration=Span(20.0, "periods"), tolerance=tolerance)
        return simulate(columns, run, cases=1).values.tobytes()


class _Clutches:
    def engagements(self, study: Study, case: int) -> Engagements:
        """Those of one turn of the settled motion for a settled study, otherwise those in the window."""
        from sprag_study.engine.vibration_drive.engagements import tables_of

        return tables_of(_examined(study, case))

    def duty(self, study: Study, case: int, exponent: float | None) -> Duty:
        """That of one turn of the settled motion for a settled study, otherwise that in the window."""
        from sprag_study.engine.vibration_drive.duty import duty_of, ratings_of

        return duty_of(_examined(study, case), ratings_of(case_machine(study, case), exponent))


def _examined(study: Study, case: int) -> Examined:
    from sprag_study.engine.vibration_drive.examined import examined, examined_settled

    columns = case_machine(study, case)
    if is_settled(study.run):
        return examined_settled(columns, settings_of(study.run), start_of(study, case))
    return examined(columns, run_of(study.run))


class _Reactions:
    def bearing(self, study: Study, case: int) -> Bearing:
        from sprag_study.engine.vibration_drive.force_results import Bearing

        return Bearing.of(case_machine(study, case))

    def forces(self, study: Study, case: int, bearing: Bearing, points: int) -> Forces:
        """Those of one turn of the settled motion for a settled study, otherwise those in the window."""
        from sprag_study.engine.vibration_drive.forces import forces, settled_forces

        columns = case_machine(study, case)
        if is_settled(study.run):
            return settled_forces(columns, settings_of(study.run), bearing, points, start_of(study, case))
        return forces(columns, run_of(study.run), bearing, points)


class _StartUps:
    def shape(self, study: Study) -> KernelShape:
        return _key_of(VibrationDrive().shape_of(study))._replace(ramped=True).shape

    def run(self, study: Study, case: int, ramps: Ramps, points: int) -> StartUp:
        from sprag_study.engine.vibration_drive.start_up import start_up

        settled = study if is_settled(study.run) else settled_study(study)
        columns = case_machine(study, case)
        return start_up(columns, ramps, settings_of(settled.run), points, start_of(study, case))


class _Strobes:
    def portrait(self, study: Study, case: int) -> Portrait:
        from sprag_study.engine.vibration_drive.portrait import portrait, settled_portrait

        columns = case_machine(study, case)
        if is_settled(study.run):
            return settled_portrait(columns, settings_of(study.run), start_of(study, case))
        return portrait(columns, run_of(study.run))

    def turn(self, study: Study, case: int, points: int) -> CaseTurn:
        return turn_of(study, case, points, lambda infos, values, own: _flags(infos, values, sensitive=own))

    def branch(self, study: Study, case: int, along: Along) -> CaseBranch:
        return branch_of(study, case, along)

    def branch_results(self, study: Study) -> tuple[str, ...]:
        return branch_results(study)

    def sections(self, study: Study, case: int, asked: Sampling) -> CaseSections:
        return sections_of(study, case, asked)

    def basin(
        self, study: Study, case: int, paths: tuple[str, str], x: NDArray[np.float64], y: NDArray[np.float64]
    ) -> Basin:
        from sprag_study.engine.vibration_drive.starts import basin

        return basin(case_machine(study, case), settings_of(study.run), paths, x, y)

    def end_state(self, study: Study, case: int) -> dict[str, float] | None:
        from sprag_study.engine.vibration_drive.start_states import end_state

        columns = case_machine(study, case)
        if not is_settled(study.run):
            return end_state(columns, run_of(study.run), start_of(study, case))
        return None if swings(columns) else end_state(columns, settings_of(study.run), start_of(study, case))


def _run_starts(task: ChunkTask, number: int) -> ChunkResult:
    """Every regime to which the starts of the cases come."""
    from sprag_study.engine.vibration_drive.starts import settle_starts

    found = settle_starts(task.columns, settings_of(task.run), further_starts(task.run), cases=task.count)
    infos = started_infos(number)
    values, further_values = with_loads_of_starts(task, found)
    own = chunk_result(task.first, found.endings, _flags(infos, found.values), values)
    # Adding zero makes negative zeros positive, as in `chunk_result`.
    further = FurtherRows(found.further, _flags(infos, found.further_values), further_values + 0.0)
    return replace(own, further=further)


def _not_laws(laws: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which laws, rows of a windup limit and its coefficients, no clutch can have."""
    # The torque rises with each coefficient, and a wider range only adds windups: where the worst of all is a law, all
    # are.
    if _is_law(np.array([laws[:, 0].max(), *laws[:, 1:].min(axis=0)])):
        return np.zeros(len(laws), dtype=np.bool_)
    different, member = np.unique(laws, axis=0, return_inverse=True)
    return np.array([not _is_law(law) for law in different])[member.reshape(-1)]


def _is_law(law: NDArray[np.float64]) -> bool:
    try:
        check_law(law[1:].tolist(), float(law[0]))
    except ClutchLawError:
        return False
    return True


def _key_of(shape: KernelShape) -> DriveKey:
    room = [part for part in shape.key[3:] if isinstance(part, int)]
    terms = tuple(part for part in shape.key[3:] if isinstance(part, str))
    numbers = cast("tuple[int, int, float]", shape.key[:3])
    curved, tabled = not {_CURVE, _TABLE}.isdisjoint(terms), _TABLE in terms
    drag, ramped = curved or _DRAG in terms, _RAMP in terms
    return DriveKey(*numbers, drag=drag, curved=curved, tabled=tabled, harmonics=sum(room), ramped=ramped)
