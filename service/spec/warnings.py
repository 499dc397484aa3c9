"""Warnings about specs that are valid but probably unintended: unstable pendulums, impossible inertias, wrong units."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sprag_study.sentences import Amount, Name, Place, Sentence
from sprag_study.service.spec.axes.axes import varied_values
from sprag_study.service.spec.fields import base_pointer
from sprag_study.service.spec.report import Report
from sprag_study.worker.derived import distinct_values, involved
from sprag_study.worker.models import HARMONIC_FACTOR, HARMONICS, LOAD_FACTOR, LOAD_TABLE, machine_shaft
from sprag_study.worker.models.parameters import parameter_of
from sprag_study.worker.models.starts import count_of, has_starts
from sprag_study.worker.study import Axis, Study

#: Up to this number all combinations of the axes involved are checked; beyond it, only the ends of the axes.
_MOST_COMBINATIONS: Final = 100_000

#: Runs of a study with many starts beyond which their number is mentioned.
_MANY_RUNS: Final = 1_000_000

_TURN: Final = 2.0 * math.pi
#: Shares of the cycle from which a table without rows there ends early: always, and where the rest is wider than its
#: other steps by this factor.
_HALF: Final = 0.5 * (1.0 - 1e-9)
_LONG: Final = 0.1
_WIDER: Final = 1.5

_MEASURED: Final = "/base/excitation/measured"
#: Frequency of the excitation, in Hz, below which it is slow.
_SLOW: Final = 0.1
#: By the kind of a motor the number that is, or multiplies, its largest torque.
_LARGEST_TORQUE: Final = {"kloss": "breakdown_torque", "linear": "stall_torque", "table": "scale"}
#: Parameters of the load of a vibration drive that mean nothing where another one is 0.
_ONLY_WITH: Final = {"shaft.cyclic_load": "shaft.load", "shaft.stribeck_speed": "shaft.stribeck_load"}


def warn_vibration_drive(report: Report, study: Study) -> None:
    """Warn of implausible values of a vibration drive anywhere on the axes of ``study``."""
    _plausible(report, study)
    runs = study.cases * count_of(study.run)
    if has_starts(study.run) and runs > _MANY_RUNS:
        report.warn(
            "many-runs",
            "/starts/count",
            Sentence(
                "{cases} cases with {starts} starts each are {runs} runs; start with a few dozen for each case",
                cases=study.cases,
                starts=count_of(study.run),
                runs=runs,
            ),
        )
    if not any(_values(study, f"excitation.amplitude_{axis}").any() or _overtones(study, axis) for axis in "xy"):
        report.warn("nothing-moves", "/base/excitation", Sentence("both amplitudes are 0, so the base does not move"))
    if _values(study, "excitation.frequency").min() < _SLOW:
        slow = Sentence("below {limit}, which is slow for a vibration drive", limit=Amount(_SLOW, "Hz"))
        report.warn("slow-excitation", _place(study, "excitation.frequency"), slow)
    for path, needed in _ONLY_WITH.items():
        if _values(study, path).any() and needed not in study.column_paths and not study.base.get(needed, 0.0):
            report.warn(
                "no-effect", _place(study, path), Sentence("has no effect: {path} is 0", path=Name(needed, within=True))
            )
    if LOAD_FACTOR in (*study.base, *study.column_paths) and f"{LOAD_TABLE}0.speed" not in study.base:
        report.warn(
            "no-effect", _place(study, LOAD_FACTOR), Sentence("has no effect: the load is not given as a table")
        )
    for path in (f"excitation.amplitude_{axis}" for axis in "xy"):
        if report.written(_MEASURED) is not None and _values(study, path).any():
            report.warn("added-vibration", _place(study, path), Sentence("is added to the measured motion"))
    if HARMONIC_FACTOR in (*study.base, *study.column_paths) and f"{HARMONICS}0.order" not in study.base:
        report.warn(
            "no-effect", _place(study, HARMONIC_FACTOR), Sentence("has no effect: the vibration has no harmonics")
        )
    pendulums = sum(path.startswith("pendulums.") and path.endswith(".mass") for path in study.base)
    _upright(report, study, pendulums)
    for index in range(pendulums):
        _stability(report, study, index)
        _inertia(report, study, index)


def warn_machine_shaft(report: Report, study: Study) -> None:
    """Warn of implausible values of a machine shaft anywhere on the axes of ``study``."""
    _plausible(report, study)
    structure = study.structure or {}
    operation_found = structure.get("balance_side") == "operation"
    for prefix, part in _parts(study):
        if structure["balance"] == "constant" and operation_found and part["operation"]["quantity"] != "none":
            where = base_pointer(f"{prefix}operation")
            report.warn(
                "replaced-value",
                where,
                Sentence(
                    'is not used: the balance "constant" on the side of the operation replaces it by a constant '
                    'torque; choose "scale" to keep its shape'
                ),
            )
    if (
        structure["balance"] == "constant"
        and not operation_found
        and (structure["drive"]["form"] != "constant" or _values(study, "drive.torque").any())
    ):
        report.warn(
            "replaced-value",
            "/base/drive/torque",
            Sentence(
                'is not used: the balance "constant" replaces it by the mean resistance; choose "scale" or "refuse" '
                "to keep its shape"
            ),
        )
    if structure["balance"] == "motor" and _values(study, "wanted_irregularity").size:
        unused = Sentence("is not used: with a motor no required inertia is computed")
        report.warn("no-effect", "/base/wanted_irregularity", unused)
    if all(
        part["operation"]["quantity"] == "none" and part["mechanism"]["kind"] == "none" for _, part in _parts(study)
    ):
        alone = Sentence("has neither a mechanism nor an operation, so the shaft turns evenly")
        report.warn("nothing-acts", "/base", alone)
    else:
        for prefix, part in _parts(study):
            if part["operation"]["quantity"] == "none" and part["mechanism"]["kind"] == "none":
                where = base_pointer(prefix.rstrip("."))
                idle = Sentence("has neither a mechanism nor an operation, so it does nothing")
                report.warn("nothing-acts", where, idle)
    _shaft_relations(report, study)


def _parts(study: Study) -> list[tuple[str, dict[str, Any]]]:
    """The mechanisms of a machine shaft with their operations: the prefix of their paths, and their structure."""
    structure = study.structure or {}
    several = structure.get("parts", ())
    return [(f"parts.{k}.", part) for k, part in enumerate(several)] or [("", structure)]


def _shaft_relations(report: Report, study: Study) -> None:
    """Warn of cases whose numbers are inconsistent; a base with such numbers is refused."""
    for prefix, part in _parts(study):
        operation = part["operation"]
        if operation["quantity"] == "gas":
            _discharge(report, study, f"{prefix}operation.gas.")
        elif operation.get("form") == "steps":
            for k in range(operation["steps"]):
                _turned_step(report, study, f"{prefix}operation.steps.{k}.", wraps=operation["over"] == "angle")
    _chosen_angle(report, study)
    _short_tables(report, study)
    _rating(report, study)


def _rating(report: Report, study: Study) -> None:
    """Warn of a rated torque that the motor gives at no speed."""
    drive, path = (study.structure or {})["drive"], "drive.motor.rated_torque"
    if path not in {*study.base, *study.column_paths}:
        return
    rated, most, weight = _columns(study, [path, f"drive.motor.{_LARGEST_TORQUE[drive['motor']]}"])
    if drive["motor"] == "table":
        most = most * max(torque for _, torque in drive["table"]["rows"])
    rated, most = np.broadcast_arrays(rated, most)
    above = rated > most
    if above.any():
        worst = int(np.argmax(np.where(above, rated / most, 0.0)))
        text = Sentence(
            "{rated} is more than the largest torque of this motor, {most}",
            rated=Amount(float(rated.flat[worst]), "N*m", 6),
            most=Amount(float(most.flat[worst]), "N*m", 6),
        )
        report.warn("implausible-value", _place(study, path), _with_share(text, above, weight))


def _short_tables(report: Report, study: Study) -> None:
    """Warn of tables over the angle that end long before their cycle: the rest is filled up to the first row."""
    structure = study.structure or {}
    cycle = structure["cycle"]
    tables = [("drive/torque", structure["drive"]["table"], cycle)] if not structure["drive"].get("motor") else []
    for prefix, part in _parts(study):
        where, mechanism, operation = prefix.replace(".", "/"), part["mechanism"], part["operation"]
        tables.append((f"{where}operation", operation.get("table") if operation["over"] == "angle" else None, cycle))
        table = mechanism.get("table")
        if table:
            one_turn = table["rows"][-1][0] - table["rows"][0][0] <= _TURN * (1.0 + 1e-9)
            tables.append((f"{where}mechanism", table, 1 if one_turn else cycle))
    for where, table, turns in tables:
        if not table:
            continue
        angles = np.array([row[0] for row in table["rows"]])
        period = _TURN * turns
        missing, widest = period - (angles[-1] - angles[0]), np.diff(angles).max(initial=0.0)
        if missing >= _HALF * period or (missing >= _LONG * period and missing > _WIDER * widest):
            last, rest, whole = (math.degrees(angle) for angle in (angles[-1], missing, period))
            report.warn(
                "table-ends-early",
                f"/base/{where}",
                Sentence(
                    "the table ends at {last}, {rest} before its cycle of {whole}; over the rest its value goes from "
                    "the last row back to the first; give rows up to the end of it",
                    last=Amount(last, "deg", 6),
                    rest=Amount(rest, "deg", 4),
                    whole=Amount(whole, "deg", 4),
                ),
            )


def _discharge(report: Report, study: Study, prefix: str) -> None:
    names = ("suction_pressure", "discharge_pressure", "clearance", "exponent")
    low, high, clearance, exponent, weight = _columns(study, [prefix + name for name in names])
    low, high, most = np.broadcast_arrays(low, high, machine_shaft.reachable_pressure(low, clearance, exponent))
    where = _place(study, f"{prefix}discharge_pressure")
    beyond, below = high > most, high < low
    if beyond.any():
        report.warn(
            "no-discharge",
            where,
            _with_share(
                Sentence(
                    "the compressor reaches {pressure} at most and discharges nothing at a higher pressure: its "
                    "valves stay shut",
                    pressure=Amount(float(most[beyond].min()), "Pa", 6),
                ),
                beyond,
                weight,
            ),
        )
    if below.any():
        text = Sentence("is below the suction pressure: nothing is compressed")
        report.warn("no-compression", where, _with_share(text, below, weight))


def _turned_step(report: Report, study: Study, prefix: str, *, wraps: bool) -> None:
    paths = [prefix + end for end in ("from", "to")]
    first, last, weight = _columns(study, paths)
    turned = np.asarray(first > last)
    varied = [path for path in paths if path in study.column_paths]
    if not varied or not turned.any() or (wraps and turned.all()):
        return
    text = (
        Sentence("where `from` exceeds `to` the step continues past the end of the cycle and acts in nearly all of it")
        if wraps
        else Sentence("where `from` exceeds `to` the step over the stroke never acts")
    )
    where = _place(study, varied[0])
    report.warn("wraps-around" if wraps else "never-acts", where, _with_share(text, turned, weight))


def _chosen_angle(report: Report, study: Study) -> None:
    """Warn where phi_c exceeds the number of angles with T = T_mean, which the base machine determines."""
    structure = study.structure or {}
    chosen = structure["phi_c"]
    if chosen is None:
        return
    count = machine_shaft.base_results(structure, study.base)["phi_c.count"]
    # Without any such angle, works count from the angle 0 whatever was chosen.
    if 0 < count <= chosen:
        report.warn(
            "no-such-angle",
            "/base/phi_c",
            Sentence(
                "{chosen} is out of range: the machine of base has {count} angles with T = T_mean, numbered 0 to "
                "{last}; it and the results of s3 and s4 stay empty",
                chosen=str(chosen),
                count=str(round(count)),
                last=str(round(count) - 1),
            ),
        )


def _values(study: Study, path: str) -> NDArray[np.float64]:
    return distinct_values(study, path) if path in study.derive else varied_values(path, study.axes, study.base)


def _plausible(report: Report, study: Study) -> None:
    """Warn of values beyond what is plausible."""
    for path in dict.fromkeys((*study.base, *study.axis_paths)):
        parameter = parameter_of(study, path)
        if parameter is None or parameter.mistake is None:
            continue
        values = _values(study, path)
        largest = float(values[np.abs(values).argmax()])
        if abs(largest) > parameter.plausible:
            limits = {
                "value": Amount(largest, parameter.unit, 6), "limit": Amount(parameter.plausible, parameter.unit, 4),
            }  # fmt: skip
            text = Sentence("{value} is more than {limit}; {question}", **limits, question=parameter.mistake)
            report.warn("implausible-value", _place(study, path), text)


def _place(study: Study, path: str) -> Place:
    """Where the spec gives the values of ``path``: its axis or its formula, or the base."""
    if path in study.derive:
        return Place("/derive", path)
    for position, axis in enumerate(study.axes):
        if path in axis.paths:
            return Place(f"/axes/{position}", path)
    return Place(base_pointer(path))


def _overtones(study: Study, axis: str) -> bool:
    """Whether the base vibrates along an axis with harmonics."""
    own = (
        value for path, value in study.base.items() if path.startswith(HARMONICS) and path.endswith(f"amplitude_{axis}")
    )
    return any(own)


def _upright(report: Report, study: Study, pendulums: int) -> None:
    """Vibration along y alone exerts no torque on a pendulum at rest in the upright position."""
    starts = [f"pendulums.{index}.initial_{name}" for index in range(pendulums) for name in ("angle", "speed")]
    across, along, *starts_at, weight = _columns(study, ["excitation.amplitude_x", "excitation.amplitude_y", *starts])
    across, along, *starts_at = np.broadcast_arrays(across, along, *starts_at)
    shaken = (along != 0.0) | _overtones(study, "y")
    still = shaken & (across == 0.0) & (not _overtones(study, "x")) & ~np.any(starts_at, axis=0)
    if still.any():
        report.warn(
            "stays-upright",
            "/base/pendulums",
            _with_share(
                Sentence(
                    "with vibration along y alone a pendulum that starts upright without speed stays upright, even at "
                    "parametric resonance, and nothing moves; give an initial angle such as {angle} or a horizontal "
                    "amplitude",
                    angle=Amount(0.01, "rad"),
                ),
                still,
                weight,
            ),
        )


def _stability(report: Report, study: Study, index: int) -> None:
    """c a^2 against M g l: below it the upright (for l > 0) position is unstable without vibration (docs/theory.md)."""
    names = ("spring_rate", "spring_arm", "mass", "arm")
    c, a, mass, arm, g, weight = _columns(study, [*(f"pendulums.{index}.{name}" for name in names), "gravity"])
    spring, gravity = np.broadcast_arrays(c * a**2, mass * g * arm)
    unstable = spring < gravity
    if unstable.any():
        worst = int(np.argmin(np.where(unstable, spring - gravity, np.inf)))
        report.warn(
            "falls-over",
            f"/base/pendulums/{index}",
            _with_share(
                Sentence(
                    "c a^2 < M g l: the spring's {spring} do not hold the pendulum up against gravity's {gravity}; "
                    "without vibration it falls to one side",
                    spring=Amount(float(spring.flat[worst]), "N*m/rad", 4),
                    gravity=Amount(float(gravity.flat[worst]), "N*m/rad", 4),
                ),
                unstable,
                weight,
            ),
        )


def _inertia(report: Report, study: Study, index: int) -> None:
    """J >= M l^2 holds for every rigid body about an axis at distance l from its centre of mass (parallel axes)."""
    names = ("inertia", "mass", "arm")
    inertia, mass, arm, weight = _columns(study, [f"pendulums.{index}.{name}" for name in names])
    have, need = np.broadcast_arrays(inertia, mass * arm**2)
    wrong = have < need * (1.0 - 1e-9)
    if wrong.any():
        worst = int(np.argmax(np.where(wrong, need - have, -np.inf)))
        report.warn(
            "impossible-inertia",
            f"/base/pendulums/{index}",
            _with_share(
                Sentence(
                    "J < M l^2: an inertia of {inertia} about the axis is less than the {needed} of the mass at its "
                    "arm alone, which no rigid body has",
                    inertia=Amount(float(have.flat[worst]), "kg*m^2", 4),
                    needed=Amount(float(need.flat[worst]), "kg*m^2", 4),
                ),
                wrong,
                weight,
            ),
        )


def _with_share(text: Sentence, concerned: NDArray[np.bool_], weight: NDArray[np.float64]) -> Sentence:
    """A sentence with the number of cases concerned, where every combination was checked."""
    cases = float(weight)
    if concerned.size == 1:
        return text
    if not cases:
        return Sentence("{sentence} (in the worst case of the axes)", sentence=text)
    some, every = int(concerned.sum() * cases), int(concerned.size * cases)
    return Sentence("{sentence} (in {some} of {all} cases)", sentence=text, some=some, all=every)


def _columns(study: Study, paths: Sequence[str]) -> list[NDArray[np.float64]]:
    """Values of ``paths`` in every combination of the axes that vary any of them, broadcastable against each other.

    The last array holds the number of cases that share a combination; 0 when only the ends of the axes were combined.
    """
    part = involved(study, paths)
    cases_each = study.cases // part.cases
    if part.cases > _MOST_COMBINATIONS:
        cases_each = 0
        if study.combine == "grid":
            ends = tuple(Axis(axis.paths, np.unique([axis.array.min(), axis.array.max()])) for axis in part.axes)
            part = replace(part, axes=ends)
    varied = part.columns(range(part.cases))
    columns = [np.asarray(varied[path] if path in varied else study.base[path], dtype=np.float64) for path in paths]
    return [*columns, np.asarray(float(cases_each))]
