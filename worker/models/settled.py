"""Settled motions of a study's cases, whatever the study's own duration and window."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from engine.catalogue import ResultInfo
from engine.run import SettledRun
from engine.vibration_drive.regimes import Regime, settled_infos
from worker.models.vibration_drive import MODEL, pendulums, run_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from worker.study import Study

#: Each regime, as it is told, and what it means.
REGIME_SENTENCES: dict[str, str] = {regime.name.lower(): regime.sentence for regime in Regime}


@dataclass(frozen=True, slots=True)
class SettledCases:
    """Settled motions of some cases.

    Attributes
    ----------
    infos : tuple of ResultInfo
        Results, in the order of the columns of ``values``.
    cases : tuple of int
    endings, regimes : lists of str
        Keys of `ENDING_SENTENCES` and of `REGIME_SENTENCES`.
    values : array, shape (cases, results)
        SI units; NaN where a result could not be computed.
    """

    infos: tuple[ResultInfo, ...]
    cases: tuple[int, ...]
    endings: list[str]
    regimes: list[str]
    values: NDArray[np.float64]


def can_settle(study: Study) -> bool:
    """Whether the study's model has motions that settle."""
    return study.model == MODEL


def settle_cases(study: Study, cases: Sequence[int], at_most: int) -> SettledCases:
    """Find the settled motion of cases of a study of vibration drives within ``at_most`` excitation periods each.

    Tolerance and reset are the study's. Raises IndexError where there is no such case.
    """
    from engine.endings import ENDING_CODES
    from engine.vibration_drive.settle import settle

    own = run_of(study.run)
    columns: dict[str, Any] = {**study.base, **study.columns(list(cases))}
    settings = SettledRun(at_most=at_most, tolerance=own.tolerance, reset=own.reset)
    batch = settle(columns, settings, cases=len(cases))
    return SettledCases(
        infos=settled_infos(pendulums(study)),
        cases=tuple(cases),
        endings=[ENDING_CODES[code].value for code in batch.endings.tolist()],
        regimes=[Regime(code).name.lower() for code in batch.regimes.tolist()],
        values=batch.values + 0.0,  # a negative zero is a zero
    )
