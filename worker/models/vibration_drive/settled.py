"""Studies with settled runs (docs/theory.md, "Settled motion")."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np

from sprag_study.engine.run import SettledRun
from sprag_study.engine.vibration_drive.parameters import CYCLIC, STRIBECK, STRIBECK_AT
from sprag_study.engine.vibration_drive.regimes import Regime

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sprag_study.engine.run import Reset
    from sprag_study.worker.study import Study

#: Path of the load that swings with the angle of the shaft. With it no motion is looked for to which a drive settles.
CYCLIC_LOAD: Final = CYCLIC
#: Paths of the load that falls with the speed, and of the speed at which it does.
STRIBECK_LOAD: Final = STRIBECK
STRIBECK_SPEED: Final = STRIBECK_AT
#: Value of "until" in `Study.run` for settled runs.
SETTLED: Final = "settled"
#: Value of the result "regime" of a motion that never repeats.
IRREGULAR: Final = float(Regime.IRREGULAR)
#: Each regime by name, and its description.
REGIME_SENTENCES: Final[dict[str, str]] = {regime.name.lower(): regime.sentence for regime in Regime}
#: Flags of cases without a periodic motion: the names of their regimes.
REGIME_FLAGS: Final[dict[str, str]] = {
    regime.name.lower(): regime.sentence for regime in (Regime.IRREGULAR, Regime.UNSETTLED)
}
#: Flag of a held motion with a clutch under torque that never lets go.
HISTORY_DEPENDENT: Final = "history_dependent"
HISTORY_FLAGS: Final[dict[str, str]] = {
    HISTORY_DEPENDENT: (
        "The shaft is held and a clutch leans on it all the time: the clutch keeps the windup with which it came "
        "there, and each windup has a motion of its own. The results belong to this run-up; another start can lead to "
        "others."
    ),
}
#: Flag of a case that came to its motion by a transient in which its start is lost.
SENSITIVE_START: Final = "sensitive_start"
START_FLAGS: Final[dict[str, str]] = {
    SENSITIVE_START: (
        "The transient before this motion makes a disturbance of the start of 1e-9 more than 1e-4 large, so that "
        "rounding may decide to which motion the case comes. The results are those of the motion that was reached; "
        "try 32 starts, which show whether there are others."
    ),
}
#: Flag of a case of a sweep whose motion does not continue that of the case before it.
JUMPED: Final = "jumped"
#: Flags of a case of a sweep that did not start from an orbit of the case before it.
ARBITRARY_START: Final = "arbitrary_start"
RESTARTED: Final = "restarted"
SWEEP_FLAGS: Final[dict[str, str]] = {
    JUMPED: (
        "The motion of the previous case of the sweep ends or becomes unstable between the two values: this case went "
        "to another motion."
    ),
    ARBITRARY_START: (
        "The previous case of the sweep has no periodic motion, so this case started from an arbitrary state of it."
    ),
    RESTARTED: "The previous case of the sweep did not end ok, so this case started from its own initial values.",
}
#: Mean periods of a periodic case, share of cases that exhaust their limit, and the periods of these relative to the
#: limit, all with disturbed runs (docs/performance.md).
_PERIODIC_PERIODS, _IRREGULAR_SHARE, _IRREGULAR_COST = 135.0, 0.15, 1.3
#: Mean periods for which a timed run is continued: a factor on its own length, and the maximum.
_FOLLOWED_TIMES, _FOLLOWED_PERIODS = 2.0, 120.0


def is_settled(run: Mapping[str, Any]) -> bool:
    """Whether a run is settled."""
    return run.get("until") == SETTLED


def swings(columns: Mapping[str, Any]) -> bool:
    """Whether the load of any of some cases, given by their parameters, swings with the angle of the shaft."""
    return bool(np.any(np.asarray(columns.get(CYCLIC_LOAD, 0.0), dtype=np.float64) > 0.0))


def settings_of(run: Mapping[str, Any]) -> SettledRun:
    """The engine's settings of a settled run, from the plain data of a study."""
    return SettledRun(
        at_most=int(run["at_most"]),
        settled=float(run["settled"]),
        max_period=int(run["max_period"]),
        tolerance=float(run["tolerance"]),
        reset=cast("Reset", run["reset"]),
    )


def settled_study(study: Study, at_most: int | None = None) -> Study:
    """The same cases with settled runs, of ``at_most`` excitation periods where given.

    All other settings of the run are kept.
    """
    usual = SettledRun()
    run: dict[str, Any] = {"at_most": usual.at_most, "settled": usual.settled, "max_period": usual.max_period}
    run |= {name: value for name, value in study.run.items() if name not in {"duration", "window"}}
    return replace(study, run=run | {"until": SETTLED} | ({} if at_most is None else {"at_most": at_most}))


def followed_periods(periods: float) -> float:
    """Estimated mean number of periods for which a timed run is continued to judge whether it had settled."""
    return min(_FOLLOWED_TIMES * periods, _FOLLOWED_PERIODS)


def mean_periods(run: Mapping[str, Any]) -> float:
    """Estimated mean number of computed periods per case, including disturbed runs."""
    most = float(run["at_most"])
    return (1.0 - _IRREGULAR_SHARE) * min(_PERIODIC_PERIODS, most) + _IRREGULAR_COST * _IRREGULAR_SHARE * most
