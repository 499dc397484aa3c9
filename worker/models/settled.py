"""Studies whose cases are run until their motion is settled (docs/theory.md, "Settled motion")."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, cast

from sprag.engine.run import SettledRun
from sprag.engine.vibration_drive.regimes import Regime

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sprag.engine.run import Reset
    from sprag.worker.study import Study

#: What `Study.run` has under "until" where cases are run until they are settled.
SETTLED: Final = "settled"
#: Each regime, as it is told, and what it means.
REGIME_SENTENCES: Final[dict[str, str]] = {regime.name.lower(): regime.sentence for regime in Regime}
#: Flags of cases whose results are not those of a periodic motion: the names of their regimes.
REGIME_FLAGS: Final[dict[str, str]] = {
    regime.name.lower(): regime.sentence for regime in (Regime.IRREGULAR, Regime.UNSETTLED)
}
#: Periods that a periodic case takes on average, the share of cases that take all they may, and what these take in
#: parts of that, with disturbed runs (docs/performance.md).
_PERIODIC_PERIODS, _IRREGULAR_SHARE, _IRREGULAR_COST = 135.0, 0.15, 1.3
#: Periods that a run of a given time is followed on, on average: so many times its own, at most so many.
_FOLLOWED_TIMES, _FOLLOWED_PERIODS = 2.0, 120.0


def is_settled(run: Mapping[str, Any]) -> bool:
    """Whether the cases of a study with that run are run until they are settled."""
    return run.get("until") == SETTLED


def settings_of(run: Mapping[str, Any]) -> SettledRun:
    """The engine's settings of a run until it is settled, from the plain data of a study."""
    return SettledRun(
        at_most=int(run["at_most"]),
        settled=float(run["settled"]),
        max_period=int(run["max_period"]),
        tolerance=float(run["tolerance"]),
        reset=cast("Reset", run["reset"]),
    )


def settled_study(study: Study, at_most: int | None = None) -> Study:
    """The same cases, run until they are settled, or for ``at_most`` excitation periods where that is given.

    Whatever else the study says of its run stays as it is.
    """
    usual = SettledRun()
    run: dict[str, Any] = {"at_most": usual.at_most, "settled": usual.settled, "max_period": usual.max_period}
    run |= {name: value for name, value in study.run.items() if name not in {"duration", "window"}}
    return replace(study, run=run | {"until": SETTLED} | ({} if at_most is None else {"at_most": at_most}))


def followed_periods(periods: float) -> float:
    """About the periods for which a run of a given time is followed on, on average, to judge whether it had settled."""
    return min(_FOLLOWED_TIMES * periods, _FOLLOWED_PERIODS)


def mean_periods(run: Mapping[str, Any]) -> float:
    """About the periods that are computed for a case on average, those of disturbed runs included."""
    most = float(run["at_most"])
    return (1.0 - _IRREGULAR_SHARE) * min(_PERIODIC_PERIODS, most) + _IRREGULAR_COST * _IRREGULAR_SHARE * most
