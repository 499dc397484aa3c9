"""What became of a due time of a schedule: its result, how much of its study is done, and a sentence about both."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from datetime import datetime
from enum import StrEnum
from typing import Any, Final

from sprag_study.sentences import Sentence, sentence_of
from sprag_study.service.languages import N_, gettext, grouped, ngettext
from sprag_study.service.reading.reader import shown_stored
from sprag_study.service.schedules.stages import StageTime


class Result(StrEnum):
    """What became of a due time. The first four may still change."""

    WAITING = "waiting"
    QUEUED = "queued"
    RUNNING = "running"
    HELD = "held"
    FINISHED = "finished"
    FAILED = "failed"
    CANCELLED = "cancelled"
    DEADLINE = "deadline"
    DELETED = "deleted"
    REFUSED = "refused"
    SKIPPED = "skipped"
    MISSED = "missed"

    @property
    def final(self) -> bool:
        """Whether the run is over."""
        return self not in {Result.WAITING, Result.QUEUED, Result.RUNNING, Result.HELD}


_SENTENCES: Final = {
    Result.WAITING: N_("Its study is about to be submitted"),
    Result.QUEUED: N_("Its study waits for workers"),
    Result.RUNNING: N_("Its study is running"),
    Result.HELD: N_("Its study is paused"),
    Result.FINISHED: N_("Finished"),
    Result.FAILED: N_("Failed"),
    Result.CANCELLED: N_("Cancelled"),
    Result.DEADLINE: N_("Ended by its deadline"),
    Result.DELETED: N_("Its study was deleted"),
    Result.REFUSED: N_("No study was submitted"),
    Result.SKIPPED: N_("Skipped"),
    Result.MISSED: N_("Missed"),
}


#: A flag that has a sentence of its own, and that counted in outcomes which do not say which flags do.
_UNSETTLED: Final = "unsettled"


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a due time.

    Attributes
    ----------
    study, name : id and name of its study; None and "" where there is none
    cases, done, ok : numbers of its cases, of those with an ending, and of those that ended ok
    endings, flags : numbers of cases by ending other than ok, and by flag; None until the run is over and they have
        been counted
    coverage : the complete part of a study that is run coarse to fine; known when the run is over
    reason : why it is held, failed, or has no study
    missed : due times just before that were not run
    ended_at : end of its study, or of the run without one
    seconds : from the first chunk of its study to its end
    trouble_flags : flags that count as trouble of this run; None until they have been counted
    stages : what took how long until the end of its study; None until the run is over and that has been read
    """

    result: Result
    study: str | None = None
    name: str = ""
    cases: int = 0
    done: int = 0
    ok: int = 0
    endings: dict[str, int] | None = None
    flags: dict[str, int] | None = None
    coverage: str | None = None
    reason: str | None = None
    missed: int = 0
    ended_at: datetime | None = None
    seconds: float | None = None
    trouble_flags: tuple[str, ...] | None = None
    stages: tuple[StageTime, ...] | None = None

    @property
    def trouble(self) -> bool:
        """Whether somebody should look: the run did not end as planned, some cases failed or have one of its
        ``trouble_flags``, or due times were missed.
        """
        planned = self.result in {Result.FINISHED, Result.DEADLINE} or not self.result.final
        return not planned or self.ok < self.done or self.missed > 0 or bool(self.flagged)

    @property
    def flagged(self) -> dict[str, int]:
        """Numbers of cases by flag that counts as trouble, as far as they have been counted; no zeros."""
        flags = self.flags or {}
        return {name: flags[name] for name in self.trouble_flags or () if flags.get(name)}

    @property
    def sentence(self) -> str:
        """The outcome in one or two sentences."""
        numbers = {"cases": self.cases, "done": self.done, "ok": self.ok}
        shown = {name: grouped(number) for name, number in numbers.items()}
        first = gettext(_SENTENCES[self.result])
        if self.study is None or self.result is Result.FAILED:
            first += f": {shown_stored(self.reason)}" if self.reason else ""
        elif self.result is Result.FINISHED and self.ok == self.cases and not self.flagged:
            first += ": " + gettext("all {cases} cases ended ok", **shown)
        else:
            first += ": " + gettext("{done} of {cases} cases are done, and {ok} of them ended ok", **shown)
        parts = [first, *(_flagged(name, count) for name, count in self.flagged.items())]
        if self.result is Result.HELD and self.reason:
            parts.append(gettext("It is held: {reason}", reason=shown_stored(self.reason)))
        if self.coverage and self.result is not Result.FINISHED:
            parts.append(gettext("Of the order from coarse to fine, {coverage}", coverage=shown_stored(self.coverage)))
        if self.missed:
            parts.append(
                ngettext(
                    "{count} due time before it was not run",
                    "{count} due times before it were not run",
                    self.missed,
                    count=grouped(self.missed),
                )
            )
        return " ".join(part if part.endswith(".") else f"{part}." for part in parts)

    def to_json(self) -> dict[str, Any]:
        """The outcome as `of_json` reads it."""
        ended = None if self.ended_at is None else self.ended_at.isoformat()
        stages = None if self.stages is None else [stage.to_json() for stage in self.stages]
        own = {"result": self.result.value, "ended_at": ended, "stages": stages}
        return {**asdict(self), **own, **self.sentences}

    @property
    def sentences(self) -> dict[str, Any]:
        """Its sentences with their values, as `of_json` reads them."""
        known = {"reason": self.reason, "coverage": self.coverage}
        return {f"{name}_values": text.to_json() for name, text in known.items() if isinstance(text, Sentence)}

    @classmethod
    def of_json(cls, data: dict[str, Any]) -> Outcome:
        """The outcome that `to_json` wrote."""
        ended = data["ended_at"]
        flags = data.get("trouble_flags", None if data["flags"] is None else [_UNSETTLED])
        own: dict[str, Any] = {
            "result": Result(data["result"]),
            "ended_at": None if ended is None else datetime.fromisoformat(ended),
            "trouble_flags": None if flags is None else tuple(flags),
            "stages": None if data.get("stages") is None else tuple(map(StageTime.of_json, data["stages"])),
        }
        values = {name: data[f"{name}_values"] for name in ("reason", "coverage") if f"{name}_values" in data}
        own |= {name: sentence_of(value) for name, value in values.items()}
        known = {item.name for item in fields(cls)}
        return cls(**{**{name: value for name, value in data.items() if name in known}, **own})


def _flagged(name: str, count: int) -> str:
    """That so many cases have a flag."""
    if name == _UNSETTLED:
        return ngettext(
            "The motion of {count} case is unsettled",
            "The motions of {count} cases are unsettled",
            count,
            count=grouped(count),
        )
    cases = ngettext("{count} case", "{count} cases", count, count=grouped(count))
    return gettext("Flag {name}", name=gettext(name.replace("_", " "))) + f": {cases}"
