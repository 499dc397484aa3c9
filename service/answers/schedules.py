"""Answers about schedules."""

from __future__ import annotations

from typing import Annotated, Any

from typing_extensions import TypedDict

from sprag.service.answers import Doc, Moment


class ScheduleRun(TypedDict):
    """A due time of a schedule and its outcome."""

    due: Moment
    state: Annotated[str, Doc("taken: about to be submitted; submitted; refused, see `problem`")]
    missed: Annotated[int, Doc("earlier due times that were missed; they are not run")]
    begun_at: Moment
    study: Annotated[str | None, Doc("id of its study; null where there is none, or it was deleted")]
    address: Annotated[str | None, Doc("address of the study")]
    problem: Annotated[str | None, Doc("why no study was submitted")]


class ScheduleSummary(TypedDict):
    """A study that is submitted on a schedule."""

    id: str
    name: str
    cron: Annotated[str | None, Doc("when it is due repeatedly, on the wall clock of `zone`")]
    at: Annotated[Moment | None, Doc("when it is due once")]
    zone: str
    window: Annotated[list[str] | None, Doc("its studies run between these times of day only")]
    priority: int
    fresh: bool
    finish_by: Annotated[str | None, Doc("deadline at which a study is held: a time of day, or a duration")]
    enabled: bool
    created_at: Moment
    next_due: Annotated[Moment | None, Doc("null when it is disabled or over")]
    last_run: ScheduleRun | None
    links: dict[str, str]


class ScheduleDetail(ScheduleSummary):
    """A schedule with its spec and its latest runs."""

    runs: Annotated[list[ScheduleRun], Doc("latest first")]
    spec: dict[str, Any]


class ScheduleList(TypedDict):
    """All schedules, newest first."""

    schedules: list[ScheduleSummary]
