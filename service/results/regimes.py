"""How pictures mark the regimes of points, and which points a line may join."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Amount
from sprag_study.service.reading.reader import Phrase, joined, plural, term
from sprag_study.worker.arrays import Bools, Floats, Ints
from sprag_study.worker.models import REGIME_SENTENCES, flags_of
from sprag_study.worker.models.vocabulary import ordinal

if TYPE_CHECKING:
    from sprag_study.worker.models import ResultInfo

#: The result with the number of excitation periods after which a motion repeats.
ORDER: Final = "regime.order"
#: The result with the whole turns that a pendulum makes in so many periods.
_WINDING: Final = re.compile(r"pendulums\.(\d+)\.winding")
#: Regime of points that no line joins, because they do not show settled motion.
UNSETTLED: Final = "unsettled"
#: Regimes that a line may join: a drive without a load coasts, as the limit of a vanishing load.
_CONTINUOUS: Final = frozenset({"coasting", "periodic"})


#: Relative difference of two speeds that a sentence does not tell apart.
_SAME: Final = 5e-4


@dataclass(frozen=True, slots=True)
class Mark:
    """How points of one regime are marked: colour and shape.

    Periodic points have the colour of their curve.
    """

    colour: str
    symbol: str


def left_out(count: int) -> Phrase:
    """That so many unsettled cases do not count."""
    return plural(
        "{count} unsettled case is left out: its results do not show settled motion",
        "{count} unsettled cases are left out: their results do not show settled motion",
        count,
    )


def motion_sentence(regime: str, order: int | None) -> Phrase:
    """Description of a motion by its regime and the order of its orbit (None: it has none)."""
    if regime != "periodic" or order is None:
        return Phrase(REGIME_SENTENCES[regime])
    if order == 1:
        return Phrase("The motion repeats after one excitation period, and disturbances of it die away.")
    return plural(
        "The motion repeats after {count} excitation period, and disturbances of it die away.",
        "The motion repeats after {count} excitation periods, and disturbances of it die away.",
        order,
    )


def rotation_sentences(results: Mapping[str, object]) -> tuple[Phrase, ...]:
    """How often each pendulum turns over along an orbit; nothing of one that swings.

    Parameters
    ----------
    results : mapping
        Results of a case by name.
    """
    order, sentences = results.get(ORDER), list[Phrase]()
    for name, turns in results.items():
        whose = _WINDING.fullmatch(name)
        if whose is None or not isinstance(turns, int) or not isinstance(order, int) or turns == 0:
            continue
        whole = plural("{count} whole turn", "{count} whole turns", abs(turns))
        periods = plural("{count} excitation period", "{count} excitation periods", order)
        number = ordinal(whose[1])
        sentences.append(
            Phrase(
                "Pendulum {number} turns over counter-clockwise: {turns} in {periods}.",
                number=number,
                turns=whole,
                periods=periods,
            )
            if turns > 0
            else Phrase(
                "Pendulum {number} turns over clockwise: {turns} in {periods}.",
                number=number,
                turns=whole,
                periods=periods,
            )
        )
    return tuple(sentences)


def without_orbit(regime: str, model: str) -> tuple[Phrase, ...]:
    """The description of a motion that has no orbit; nothing of another one."""
    return (motion_sentence(regime, None),) if regime in flags_of(model) else ()


def coasting_sentence(results: Mapping[str, object]) -> Phrase | None:
    """That the run of a case comes to another speed than the one that is its result; None where it does not.

    Without a load every speed above the pendulums' is steady, so a motion over time depends on its start, and the
    result is the limit of a vanishing load (docs/theory.md, "No load").

    Parameters
    ----------
    results : mapping
        Results of a case by name, SI.
    """
    limit, reached = results.get("shaft.speed.mean"), results.get("shaft.speed.from_rest")
    if not (isinstance(limit, float) and isinstance(reached, float) and math.isfinite(reached)):
        return None
    if math.isclose(reached, limit, rel_tol=_SAME):
        return None
    return Phrase(
        "A motion without a load depends on its start: the motion over time, from the case's own start, comes to "
        "{reached} and keeps it.",
        reached=Amount(reached, "rad/s", 3),
    )


#: Colours that are distinguishable with any kind of colour vision, and shapes that replace them in grey.
MARKS: Final[dict[str, Mark]] = {
    "periodic": Mark("#777777", "circle"),
    "held": Mark("#8c6d31", "square"),
    "coasting": Mark("#56b4e9", "diamond"),
    "irregular": Mark("#cc79a7", "triangle-up"),
    UNSETTLED: Mark("#d55e00", "x"),
}
#: Regimes that are marked on their curves.
MARKED: Final = tuple(name for name in MARKS if name != "periodic")
#: Regimes whose points are marked in maps: their results have an interval, or do not show settled motion.
DOUBTFUL: Final = ("irregular", UNSETTLED)


def stretches(regimes: Sequence[str | None] | None, points: int, usable: Bools | None = None) -> list[Ints]:
    """Indices of the points that a line joins: neighbours of one regime, or coasting and periodic.

    A point without a regime (it has no result) belongs to no stretch, unless the study has no regimes at all. A point
    whose result does not count (``usable``) is a stretch of its own.
    """
    counts = np.ones(points, dtype=np.bool_) if usable is None else usable
    if regimes is None and counts.all():
        return [np.arange(points, dtype=np.int64)]
    found: list[list[int]] = []
    for place in range(points):
        regime, before = (None, None) if regimes is None else (regimes[place], regimes[place - 1])
        if regimes is not None and regime is None:
            continue
        both = bool(counts[place] and counts[place - 1])
        if found and both and (regime == before or {regime, before} == _CONTINUOUS):
            found[-1].append(place)
        else:
            found.append([place])
    return [np.array(stretch, dtype=np.int64) for stretch in found]


def kind_columns(regime: ResultInfo | None) -> list[str]:
    """Names of the results for the kind of motion of a case: its regime, and the order of its orbit."""
    return [] if regime is None else [regime.name, ORDER]


def kinds_of(
    columns: Mapping[str, Floats], regime: ResultInfo | None
) -> tuple[list[str | None] | None, list[int | None] | None]:
    """Name of the regime and order of the orbit of each case; None for cases without, and where there are no regimes.

    ``columns`` has the results of `kind_columns`.
    """
    if regime is None:
        return None, None
    name, order = kind_columns(regime)
    names = [None if cell is None else str(cell) for cell in map(regime.cell, columns[name].tolist())]
    return names, [None if math.isnan(value) else int(value) for value in columns[order].tolist()]


def regimes_of(lists: Iterable[Sequence[str | None] | None]) -> list[str]:
    """The regimes that occur, in the order of `MARKS`."""
    occurring = {regime for regimes in lists for regime in regimes or ()}
    return [name for name in MARKS if name in occurring]


def counted(counts: Mapping[str, int]) -> Phrase:
    """The number of cases by regime, in words: ``486 periodic, 24 irregular``."""
    return joined(", ", (_counted(name, count) for name, count in counts.items()))


def _counted(regime: str, count: int) -> Phrase:
    """So many motions of a regime; words of other languages agree with the number."""
    match regime:
        case "periodic":
            return plural("{count} periodic", "{count} periodic", count)
        case "held":
            return plural("{count} held", "{count} held", count)
        case "coasting":
            return plural("{count} coasting", "{count} coasting", count)
        case "irregular":
            return plural("{count} irregular", "{count} irregular", count)
        case "unsettled":
            return plural("{count} unsettled", "{count} unsettled", count)
    return Phrase("{count} {regime}", count=count, regime=term(regime))
