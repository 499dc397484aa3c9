"""Rounds of studies that choose their own cases, as answers and in words."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from sprag_study.sentences import Amount
from sprag_study.service.json_text import timestamp
from sprag_study.service.languages import N_, decimal
from sprag_study.service.reading.reader import Phrase, joined, plural
from sprag_study.service.reading.wording import number, percent
from sprag_study.worker.planning.calibrate.plan import CALIBRATE
from sprag_study.worker.planning.goals.fresh import FRESH
from sprag_study.worker.planning.goals.plan import GOAL
from sprag_study.worker.states import StudyState

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.answers.studies import Round, Rounds
    from sprag_study.service.storage.studies.records import RoundProgress, RoundRecord


def rounds_json(rounds: RoundProgress, state: StudyState, units: Sequence[str] = ()) -> Rounds:
    """Where a study stands that is in this state, in short; ``units`` as for `sentence`."""
    reached = {name: value for name, value in rounds.latest.summary.items() if not isinstance(value, dict | list)}
    return {
        "round": _number(rounds),
        "most": _most(rounds),
        "most_cases": rounds.most_cases,
        "sentence": sentence(rounds, state, units),
        "state": reached,
    }


def round_json(record: RoundRecord) -> Round:
    """One round with what was known when it was planned. The answer of a calibration has an address of its own."""
    return {
        "round": record.round + 1,
        "first_case": record.cases.start,
        "cases": len(record.cases),
        "planned_at": timestamp(record.planned_at),
        "summary": {name: value for name, value in record.summary.items() if name != "answer"},
    }


def sentence(rounds: RoundProgress, state: StudyState, units: Sequence[str] = ()) -> Phrase:
    """For people: "round 3 of at most 12, error now 2.1 %, asked 1 %", "generation 12 of 60, 240 feasible"; of a queued
    study "waiting for round 1 of at most 12". ``units`` are those of the goals of a search, which it has not itself.
    """
    where, *reached = _parts(rounds, units)
    if state is not StudyState.QUEUED:
        return joined(", ", [where, *reached])
    waiting = Phrase("waiting for {where}", where=where)
    return joined(", ", [waiting, *(reached if rounds.latest.round else [])])


def _parts(rounds: RoundProgress, units: Sequence[str]) -> list[Phrase]:
    """Which round it is, then what the rounds have reached."""
    if rounds.latest.summary.get("kind") == GOAL:
        return _search(rounds.latest.summary, units)
    if rounds.latest.summary.get("kind") == CALIBRATE:
        return _calibration(_number(rounds), rounds.latest.summary)
    first = Phrase("round {round} of at most {most}", round=_number(rounds), most=_most(rounds))
    ended = not rounds.latest.cases
    if ended:
        first = plural("{count} round", "{count} rounds", _number(rounds))
    return [first, *_state(rounds.latest.summary, ended=ended)]


def _number(rounds: RoundProgress) -> int:
    """The number of the round, from 1; the number of all rounds where they have ended."""
    return rounds.latest.round + (1 if rounds.latest.cases else 0)


def _most(rounds: RoundProgress) -> int:
    """Rounds at most; cases that are run again can lead to a further one."""
    return max(rounds.most, _number(rounds))


def _state(summary: dict[str, Any], *, ended: bool) -> list[Phrase]:
    """What a summary says of the requested error."""
    asked, error = summary.get("asked"), summary.get("error")
    if asked is None:
        return []
    if error is None:
        now = Phrase("error not known") if ended else Phrase("error not known yet")
    else:
        text = N_("error {error}") if ended else N_("error now {error}")
        now = Phrase(text, error=percent(error))
    missed = [Phrase("not reached with the cases allowed")] if ended and not summary.get("passed", True) else []
    if summary.get("each"):
        # Errors of several kinds are compared by how many times the asked ones they are.
        if error is not None:
            now = Phrase("largest error {times} times the one asked", times=number(error / asked, 3))
        return [now, *missed]
    return [now, Phrase("asked {error}", error=percent(asked)), *missed]


#: What a calibration is at.
_PHASES: Final = {
    "scan": Phrase("scan"),
    "fit": Phrase("fit"),
    "intervals": Phrase("refits for the intervals"),
    "curve": Phrase("fitted curve"),
}


def _calibration(number: int, summary: dict[str, Any]) -> list[Phrase]:
    """What a calibration is at: "round 5", "fit", "chi-square 21.3 of 26 degrees of freedom"."""
    phase = Phrase("calibrated") if summary["complete"] else Phrase("ended before all was run")
    parts = [plural("{count} round", "{count} rounds", number), phase]
    if summary["phase"] != "ended":
        parts = [Phrase("round {round}", round=number), _PHASES[summary["phase"]]]
    square = summary["chi_square"]
    if square is not None:
        freedom = summary["freedom"]
        parts.append(
            plural(
                "chi-square {value} for {count} degree of freedom",
                "chi-square {value} for {count} degrees of freedom",
                freedom,
                value=decimal(f"{square:.3g}"),
            )
        )
    return parts


def _search(summary: dict[str, Any], units: Sequence[str]) -> list[Phrase]:
    """What a search for designs has reached: "generation 12 of 60", "240 feasible", "best 0.84"."""
    generation, generations, feasible = summary["generation"], summary["generations"], summary["feasible"]
    parts = [Phrase("generation {number} of {most}", number=generation + 1, most=generations)]
    if summary["phase"] != "search":
        parts = [plural("{count} generation", "{count} generations", generation)]
        end = Phrase("finish by derivatives") if "finish" in summary else Phrase("polish of equalities")
        end = Phrase("best design with fresh drives") if summary["phase"] == FRESH else end
        parts += [] if summary["phase"] == "ended" else [end]
    reached = zip(summary["best"], units or [""] * len(summary["best"]), strict=True)
    best = joined(" / ", (Amount(value, unit, 3) for value, unit in reached if value is not None))
    exact = (summary["polish"] or {}).get("met", 0)
    parts.append(Phrase("{count} feasible", count=feasible) if feasible else Phrase("none feasible"))
    if exact:
        parts.append(Phrase("{count} exact", count=exact))
    if best:
        parts.append(
            Phrase("best of the exact {values}", values=best) if exact else Phrase("best {values}", values=best)
        )
    return parts
