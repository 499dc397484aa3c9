"""Answers about schedules."""

from __future__ import annotations

from typing import Annotated, Any

from typing_extensions import TypedDict

from sprag_study.service.answers import Doc, Moment


class RunOutcome(TypedDict):
    """What became of a due time of a schedule."""

    result: Annotated[
        str,
        Doc(
            "of a study: queued, running, held (paused), finished, failed, cancelled, deadline (held by it for good), "
            "deleted; without one: waiting (about to be submitted), refused, skipped, missed"
        ),
    ]
    trouble: Annotated[
        bool,
        Doc(
            "it did not end as planned, some cases failed or have one of `trouble_flags`, or due times before it were "
            "not run"
        ),
    ]
    sentence: str
    cases: int
    done: Annotated[int, Doc("cases that have an ending")]
    ok: int
    endings: Annotated[
        dict[str, int] | None,
        Doc("cases by ending other than ok; null until the run is over and they have been counted"),
    ]
    flags: Annotated[dict[str, int] | None, Doc("cases by flag; null until the run is over and they have been counted")]
    trouble_flags: Annotated[
        list[str] | None, Doc("flags that count as trouble of this run; null until they have been counted")
    ]
    coverage: Annotated[str | None, Doc("complete part of a study that is run coarse to fine, once the run is over")]
    ended_at: Moment | None
    seconds: Annotated[float | None, Doc("from the first chunk of the study to its end, in s")]


class ScheduleRun(TypedDict):
    """A due time of a schedule and its outcome."""

    due: Moment
    due_local: Annotated[str, Doc("the same on the wall clock of the schedule's zone, with its offset")]
    state: Annotated[str, Doc("taken: about to be submitted; submitted; refused, skipped or missed, see `problem`")]
    missed: Annotated[int, Doc("earlier due times that were missed; they are not run")]
    begun_at: Moment
    study: Annotated[str | None, Doc("id of its study; null where there is none, or it was deleted")]
    address: Annotated[str | None, Doc("address of the study")]
    problem: Annotated[str | None, Doc("why no study was submitted")]
    outcome: RunOutcome


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
    overlap: Annotated[str, Doc("while an earlier study has not ended: queue, skip or replace")]
    catch_up: Annotated[str, Doc("due times that were missed: the latest is run, all, or none")]
    misfire_grace: Annotated[str | None, Doc("longest delay with which a due time is still run; null: any")]
    enabled: bool
    paused_until: Annotated[Moment | None, Doc("it is not due before")]
    trouble_flags: Annotated[
        list[str] | None,
        Doc("flags of cases that need attention; null: those of motions that had not settled, as the model names them"),
    ]
    report_email: Annotated[list[str], Doc("addresses to which its runs are reported")]
    report_webhook: Annotated[str | None, Doc("address of a webhook to which its runs are reported")]
    report_when: Annotated[str, Doc("always; trouble: only runs that need attention")]
    created_at: Moment
    next_due: Annotated[Moment | None, Doc("null when it is disabled or over, and in a copy of a database")]
    next_due_local: Annotated[str | None, Doc("the same on the wall clock of `zone`, with its offset")]
    last_run: ScheduleRun | None
    owner: Annotated[str | None, Doc("user to whom it and its studies belong; null: no owner")]
    etag: Annotated[str, Doc("edition of its fields, for `If-Match`")]
    links: dict[str, str]


class ScheduleDetail(ScheduleSummary):
    """A schedule with its spec and its latest runs."""

    off: Annotated[str | None, Doc("why it does not run: the database is a copy; null where schedules run")]
    runs: Annotated[list[ScheduleRun], Doc("latest first")]
    spec: dict[str, Any]


class ScheduleList(TypedDict):
    """All schedules, newest first."""

    off: Annotated[str | None, Doc("why none of them runs: the database is a copy; null where they run")]
    schedules: list[ScheduleSummary]


class SentReport(TypedDict):
    """A report about a due time."""

    id: Annotated[str, Doc("in the Message-ID of a mail, and the webhook-id of a webhook")]
    kind: Annotated[str, Doc("run: about a run that is over; overdue: about a due time at which nothing ran")]
    channel: Annotated[str, Doc("email or webhook")]
    target: Annotated[str, Doc("mail address, or origin of the webhook")]
    state: Annotated[str, Doc("waiting, sent or failed")]
    attempts: int
    created_at: Moment
    ended_at: Annotated[Moment | None, Doc("when it was sent, or given up")]
    problem: Annotated[str | None, Doc("why the last attempt failed")]


class StageSeconds(TypedDict):
    """A stage of a due time, and how long it took."""

    stage: Annotated[
        str,
        Doc(
            "waiting (until its first case), checking, compiling, computing, writing, planning (of further rounds), "
            "interrupted (held, or nothing of it ran in between), report (made and sent)"
        ),
    ]
    seconds: Annotated[float, Doc("how long it took in all, in s; together the stages fill the time")]
    begin: Annotated[Moment, Doc("it lies between `begin` and `end`, perhaps in parts")]
    begin_local: Annotated[str, Doc("the same on the wall clock of the schedule's zone, with its offset")]
    end: Moment
    end_local: str


class NightRun(TypedDict):
    """A due time of the last hours, and what became of it."""

    schedule: Annotated[str, Doc("id of the schedule, which may have been deleted since")]
    name: str
    zone: str
    due: Moment
    due_local: Annotated[str, Doc("the same on the wall clock of `zone`, with its offset")]
    study: Annotated[str | None, Doc("id of its study; null where there is none, or it was deleted")]
    outcome: RunOutcome
    reports: list[SentReport]
    stages: Annotated[
        list[StageSeconds] | None, Doc("what took how long, from the due time on; null until the run is over")
    ]


class LateRun(TypedDict):
    """A due time at which nothing has run although it should."""

    schedule: Annotated[str, Doc("id of the schedule")]
    name: str
    zone: str
    due: Moment
    due_local: Annotated[str, Doc("the same on the wall clock of `zone`, with its offset")]
    study: Annotated[str | None, Doc("id of its study, which should run; null where there is none")]
    sentence: str


class Night(TypedDict):
    """What schedules did in the last hours."""

    since: Moment
    until: Moment
    off: Annotated[str | None, Doc("why none runs from now on: the database is a copy; null where they run")]
    trouble: Annotated[int, Doc("number of due times that need attention")]
    late: Annotated[list[LateRun], Doc("due times at which nothing has run although it should")]
    runs: Annotated[list[NightRun], Doc("first those that need attention, each group latest first")]
