"""Regimes of settled motion, and the results that describe them."""

from collections.abc import Mapping
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.catalogue import ResultInfo
from sprag_study.engine.vibration_drive.results import result_infos

Floats = NDArray[np.float64]


class Regime(IntEnum):
    """The motion that a case approaches from its own start."""

    #: None: the case did not end ok.
    NONE = 0
    #: A stable orbit of the strobe map, which the run approaches.
    PERIODIC = 1
    #: Periodic, and the shaft never turns.
    HELD = 2
    #: Without a load: no clutch transmits any more, the shaft turns steadily.
    COASTING = 3
    #: No orbit up to the largest order; means are stationary and have an interval.
    IRREGULAR = 4
    #: The search ended while the motion still changed.
    UNSETTLED = 5

    @property
    def sentence(self) -> str:
        """Description of the regime."""
        return _SENTENCES[self]

    @property
    def repeats(self) -> bool:
        """Whether the motion has an orbit, with an order."""
        return self in (Regime.PERIODIC, Regime.HELD, Regime.COASTING)


_SENTENCES = {
    Regime.NONE: "The case did not end ok.",
    Regime.PERIODIC: (
        "The motion repeats after a whole number of excitation periods, and disturbances of it die away."
    ),
    Regime.HELD: "The pendulums settle to a periodic motion, or to rest, and never turn the shaft.",
    Regime.COASTING: "Without a load the shaft turns steadily at the limit of a vanishing load.",
    Regime.IRREGULAR: (
        "The motion never repeats, but its means are stationary: they have the half width of their 95 % "
        "interval; extremes are those observed."
    ),
    Regime.UNSETTLED: "The motion still changed when the search ended: the results are those of its last periods.",
}

#: Results that are means over the window, with or without a pendulum's prefix; irregular motion gives them half widths.
_MEANS = frozenset(
    {
        "shaft.speed.mean", "torque.mean", "power.useful.mean", "power.clutch.mean", "power.input.mean",
        "power.loss.mean", "power.bearing.mean", "power.linear.mean", "power.quadratic.mean", "power.stored.mean",
        "efficiency", "fraction.rotating", "fraction.held", "fraction.driven",
        "clutches.engagements_per_period", "angle.mean", "fraction.engaged", "fraction.beyond_data", "power.input",
        "power.loss", "power.clutch_loss",
    }
)  # fmt: skip

_OWN = (
    ResultInfo(
        "regime",
        "1",
        "what the motion settles to: " + ", ".join(regime.name.lower() for regime in Regime if regime),
        "category",
        tuple(regime.name.lower() for regime in Regime),
    ),
    ResultInfo("regime.order", "1", "excitation periods after which the motion repeats itself", "count"),
    ResultInfo("regime.multiplier", "1", "factor by which disturbances of the orbit shrink in one turn of it"),
    ResultInfo("regime.settled_after", "1", "excitation periods from the start until the motion is settled"),
    ResultInfo("regime.residual", "1", "scaled distance by which the orbit misses itself, at most"),
    ResultInfo("regime.exponent", "1", "growth of disturbances of an irregular motion per period (Lyapunov exponent)"),
    ResultInfo("shaft.speed.from_rest", "rad/s", "without a load: speed that the shaft reaches from its own start"),
)


def winding(pendulum: int) -> str:
    """Name of the result that counts the whole turns of a pendulum in one turn of the orbit."""
    return f"pendulums.{pendulum}.winding"


def _windings(pendulums: int) -> tuple[ResultInfo, ...]:
    what = (
        "whole turns of the pendulum, counter-clockwise, in the regime.order excitation periods after which the motion "
        "repeats itself; 0 where it swings, otherwise its angle has no mean, no extremes and no amplitude"
    )
    return tuple(ResultInfo(winding(i), "1", what, "count", generation=3) for i in range(pendulums))


def angles_without_meaning(windings: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which results of orbits are the mean, the extremes or the amplitude of the angle of a pendulum that turns over.

    Parameters
    ----------
    windings : array, shape (orbits, pendulums)

    Returns
    -------
    array, shape (orbits, results)
        Results in the order of ``result_infos``.
    """
    names = [info.name for info in result_infos(windings.shape[1])]
    nothing = np.zeros((len(windings), len(names)), dtype=np.bool_)
    for i in range(windings.shape[1]):
        columns = [place for place, name in enumerate(names) if name.startswith(f"pendulums.{i}.angle.")]
        nothing[np.ix_(windings[:, i] != 0, columns)] = True
    return nothing


def means(pendulums: int) -> tuple[int, ...]:
    """Indices into ``result_infos`` of the results that are means."""
    names = [info.name for info in result_infos(pendulums)]
    own = [name.split(".", 2)[2] if name.startswith("pendulums.") else name for name in names]
    return tuple(place for place, name in enumerate(own) if name in _MEANS)


def keeps_windup(engaged: Floats, held: Floats, engagements: Floats) -> NDArray[np.bool_]:
    """Where a clutch leans on a held shaft throughout: its pendulum's angle and its windup differ by a constant.

    Parameters
    ----------
    engaged, held : arrays, shape (cases,)
        Time, or share of it, in which the clutch transmits torque and in which the shaft is held, over a whole turn of
        an orbit along which the shaft never turns.
    engagements : array, shape (cases,)
        Engagements of the clutch in that turn.
    """
    return np.asarray((held > 0.0) & (engaged == held) & (engagements == 0.0))


def depends_on_history(values: Mapping[str, Floats]) -> NDArray[np.bool_]:
    """Which settled motions are one of a continuum, of which the run-up chooses one (docs/theory.md).

    Parameters
    ----------
    values : mapping
        Results of settled cases by name, each of shape (cases,).
    """
    prefixes = [name.removesuffix("fraction.engaged") for name in values if name.endswith(".fraction.engaged")]
    kept = [
        keeps_windup(values[f"{own}fraction.engaged"], values["fraction.held"], values[f"{own}engagements"])
        for own in prefixes
    ]
    return np.asarray((values["regime"] == Regime.HELD) & np.any(kept, axis=0))


def settled_infos(pendulums: int) -> tuple[ResultInfo, ...]:
    """Every result of a settled case, in the order of the columns of ``settle``."""
    infos = result_infos(pendulums)
    widths = [
        ResultInfo(
            f"{infos[place].name}.half_width",
            infos[place].unit,
            f"half width of the 95 % interval of {infos[place].name}",
            generation=infos[place].generation,
        )
        for place in means(pendulums)
    ]
    return (*infos, *_OWN, *_windings(pendulums), *widths)
