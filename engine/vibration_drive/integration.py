"""One call of a kernel: its work arrays and its output."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.run import Run
from sprag_study.engine.taylor.batch import aligned_zeros, blocks_for
from sprag_study.engine.taylor.roots import MAX_DEGREE, work_stack
from sprag_study.engine.taylor.straight import same_everywhere
from sprag_study.engine.vibration_drive.cases import STOPS, stop_column
from sprag_study.engine.vibration_drive.characteristics import sum_columns
from sprag_study.engine.vibration_drive.kernel import Kernel
from sprag_study.engine.vibration_drive.layout import pendulum_samples
from sprag_study.engine.vibration_drive.pieces import piece_width
from sprag_study.engine.vibration_drive.states import LANE_INTEGERS
from sprag_study.engine.vibration_drive.strobes import from_rest, width

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Integration:
    """The output of a kernel.

    Attributes
    ----------
    sums : array, shape (cases, sum_columns(layout))
    strobes : array, shape (cases, strobes, strobes.width(n))
        States at the strobes; the shaft's turn counts from the start of the call. For a run with more strobes, the last
        ones, each at its number modulo their count (``strobes.in_order``).
    samples, states : arrays, shape (times, columns)
        Instantaneous values of case 0, and states of its shaft and clutches.
    recorded : int
        Times that were reached.
    pieces : array, shape (pieces, piece_width(layout))
        Steps of case 0 as ``pieces.Pieces`` reads them; rows that no step filled are NaN.
    """

    sums: Floats
    strobes: Floats
    samples: Floats
    states: Ints
    recorded: int
    pieces: Floats


def integrate(
    kernel: Kernel,
    matrix: Floats,
    run: Run,
    *,
    starts: Floats | None = None,
    before: Floats | None = None,
    strobes: int = 0,
    times: Floats | None = None,
    pieces: int = 0,
    since: float = 0.0,
) -> Integration:
    """Run the cases of ``matrix`` (from ``cases.case_matrix``) from rest or from ``starts``.

    ``run`` gives tolerance, reset and event budget; the lengths and step budgets of the runs stand in the matrix.
    ``strobes`` is the number of strobes recorded of each case, ``times`` (in excitation periods) where case 0 is
    sampled, ``pieces`` the most steps of case 0 that are kept, from the time ``since`` (in excitation periods) on.
    ``before`` has the sums of an earlier window of the same cases: extrema are then those of both, and cost less.
    """
    lay = kernel.LAYOUT
    cases, n = len(matrix), lay.n
    asked = np.empty(0) if times is None else times
    sums = np.full((cases, sum_columns(lay)), np.nan) if before is None else before.copy()
    recorded = np.full((cases, strobes, width(n)), np.nan)
    end = matrix[:, stop_column(STOPS - 1)]
    samples = np.empty((len(asked), pendulum_samples(n).start))
    states = np.zeros((len(asked), 1 + n), dtype=np.int64)
    steps = np.full((pieces, piece_width(lay)), np.nan)
    # Guards (7 a pendulum and shaft at most) and extrema (14) that all lanes together can list in a step.
    listed = lay.lanes * (6 + 8 * n)
    done = kernel.integrate(
        kernel.RECORD, matrix, from_rest(cases, n) if starts is None else starts, recorded,
        run.tolerance, same_everywhere(math.log2(run.tolerance)), int(run.reset == "literal"),
        run.max_events_per_period, aligned_zeros(lay.rows * lay.lanes).reshape(lay.rows, lay.lanes),
        np.zeros((lay.lanes, LANE_INTEGERS), dtype=np.int64),
        np.zeros(MAX_DEGREE + 1), work_stack(),
        blocks_for(listed, lay.order), np.zeros((listed, 3), dtype=np.int64),
        np.zeros((lay.lanes, int(np.max(end, initial=0.0)) + 3)), sums, asked, samples, states,
        float(since), steps,
    )  # fmt: skip
    return Integration(sums, recorded, samples, states, done, steps)
