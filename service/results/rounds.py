"""Rounds of studies that choose their own cases, as answers and in words."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sprag.service.results.wording import counted, percent
from sprag.worker.planning.calibrate.plan import CALIBRATE
from sprag.worker.planning.goals.plan import GOAL

if TYPE_CHECKING:
    from sprag.service.answers.studies import Round, Rounds
    from sprag.service.storage.records import RoundProgress, RoundRecord


def rounds_json(rounds: RoundProgress) -> Rounds:
    """Where a study stands, in short."""
    state = {name: value for name, value in rounds.latest.summary.items() if not isinstance(value, dict | list)}
    return {
        "round": _number(rounds),
        "most": _most(rounds),
        "most_cases": rounds.most_cases,
        "sentence": sentence(rounds),
        "state": state,
    }


def round_json(record: RoundRecord) -> Round:
    """One round with what was known when it was planned. The answer of a calibration has an address of its own."""
    return {
        "round": record.round + 1,
        "first_case": record.cases.start,
        "cases": len(record.cases),
        "planned_at": record.planned_at.isoformat(),
        "summary": {name: value for name, value in record.summary.items() if name != "answer"},
    }


def sentence(rounds: RoundProgress) -> str:
    """For people: "round 3 of at most 12, error now 2.1 %, asked 1 %", "generation 12 of 60, 240 feasible"."""
    if rounds.latest.summary.get("kind") == GOAL:
        return ", ".join(_search(rounds.latest.summary))
    if rounds.latest.summary.get("kind") == CALIBRATE:
        return ", ".join(_calibration(_number(rounds), rounds.latest.summary))
    told = [f"round {_number(rounds)} of at most {_most(rounds)}"]
    if not rounds.latest.cases:
        told = [counted(_number(rounds), "round")]
    ended = not rounds.latest.cases
    return ", ".join([*told, *_state(rounds.latest.summary, ended=ended)])


def _number(rounds: RoundProgress) -> int:
    """The number of the round, from 1; the number of all rounds where they have ended."""
    return rounds.latest.round + (1 if rounds.latest.cases else 0)


def _most(rounds: RoundProgress) -> int:
    """Rounds at most; cases that are run again can lead to a further one."""
    return max(rounds.most, _number(rounds))


def _state(summary: dict[str, Any], *, ended: bool) -> list[str]:
    """What a summary says of the requested error."""
    asked, error = summary.get("asked"), summary.get("error")
    if asked is None:
        return []
    when = ("", "") if ended else (" yet", " now")
    now = f"error not known{when[0]}" if error is None else f"error{when[1]} {percent(error)}"
    missed = ["not reached with the cases allowed"] if ended and not summary.get("passed", True) else []
    return [now, f"asked {percent(asked)}", *missed]


def _calibration(number: int, summary: dict[str, Any]) -> list[str]:
    """What a calibration is at: "round 5", "fit", "chi-square 21.3 of 26 degrees of freedom"."""
    phases = {"scan": "scan", "fit": "fit", "intervals": "refits for the intervals", "curve": "fitted curve"}
    phase = "calibrated" if summary["complete"] else "ended before all was run"
    ended = summary["phase"] == "ended"
    told = [counted(number, "round"), phase] if ended else [f"round {number}", phases[summary["phase"]]]
    square = summary["chi_square"]
    freedom = summary["freedom"]
    return [*told, *([f"chi-square {square:.3g} for {freedom} degrees of freedom"] if square is not None else [])]


def _search(summary: dict[str, Any]) -> list[str]:
    """What a search for designs has reached: "generation 12 of 60", "240 feasible", "best 0.84"."""
    generation, generations, feasible = summary["generation"], summary["generations"], summary["feasible"]
    told = [f"generation {generation + 1} of {generations}"]
    if summary["phase"] != "search":
        ended = counted(generation, "generation")
        told = [ended] if summary["phase"] == "ended" else [ended, "polish of equalities"]
    best = [f"{value:.3g}" for value in summary["best"] if value is not None]
    exact = (summary["polish"] or {}).get("met", 0)
    told.append(f"{feasible:,} feasible" if feasible else "none feasible")
    return [*told, *([f"{exact:,} exact"] * bool(exact)), *([f"best {' and '.join(best)}"] * bool(best))]
