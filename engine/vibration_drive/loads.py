"""Forces and duty of every case of a batch, as columns beside its results (docs/theory.md, "Forces", "Duty of the
clutches").

They are those of the views of one case: computed from the steps of one more turn of its settled motion, or from those
of its run, case after case.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.outcome import Duty, Forces
from sprag_study.engine.run import Run, SettledRun
from sprag_study.engine.vibration_drive.cases import of_cases, pendulum_count, scalars
from sprag_study.engine.vibration_drive.duty import duty_of, ratings_of
from sprag_study.engine.vibration_drive.examined import examined, examined_motion
from sprag_study.engine.vibration_drive.force_results import Bearing
from sprag_study.engine.vibration_drive.forces import forces, forces_of_motion
from sprag_study.engine.vibration_drive.load_results import duty_fields, duty_name, load_infos
from sprag_study.engine.vibration_drive.settle import SettledBatch

Floats = NDArray[np.float64]

_OK = ENDINGS.index(Ending.OK)


def settled_loads(columns: Mapping[str, ArrayLike], settings: SettledRun, settled: SettledBatch) -> Floats:
    """Forces and duty of the settled motions that ``settle`` has given.

    Parameters
    ----------
    columns : mapping
        As for ``simulate``; the ratings of bearings and clutches among them.
    settings : SettledRun
    settled : SettledBatch
        Of these cases.

    Returns
    -------
    array, shape (cases, results)
        In the order of ``load_infos(pendulums)``; NaN where a case did not end ok, and where a value does not exist.
    """
    names = [info.name for info in load_infos(pendulum_count(columns))]
    rows = np.full((len(settled.endings), len(names)), math.nan)
    for case in np.flatnonzero(settled.endings == _OK).tolist():
        values, motion = scalars(of_cases(columns, case)), settled.of_case(case)
        reactions = forces_of_motion(values, settings, motion, Bearing.of(values))
        duty = duty_of(examined_motion(values, settings, motion), ratings_of(values))
        rows[case] = _row(reactions, duty, names)
    return rows


def loads(columns: Mapping[str, ArrayLike], run: Run, endings: NDArray[np.int8]) -> Floats:
    """Forces and duty in the windows of runs of a given time, of which ``endings`` has those of the cases.

    Parameters and result are as of ``settled_loads``.
    """
    names = [info.name for info in load_infos(pendulum_count(columns))]
    rows = np.full((len(endings), len(names)), math.nan)
    for case in np.flatnonzero(endings == _OK).tolist():
        values = scalars(of_cases(columns, case))
        duty = duty_of(examined(values, run), ratings_of(values))
        rows[case] = _row(forces(values, run, Bearing.of(values)), duty, names)
    return rows


def _row(reactions: Forces, duty: Duty, names: Sequence[str]) -> list[float]:
    values = dict(reactions.results)
    for clutch in duty.rows:
        values |= {duty_name(clutch.clutch, field): getattr(clutch, field) for field in duty_fields()}
    return [values.get(name, math.nan) for name in names]
