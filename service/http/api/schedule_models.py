"""Bodies of the answers about schedules, as `sprag.service.http.api.models` has the others."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from pydantic import Field

from sprag.service.http.api.models import Body


class ScheduleRun(Body):
    """A due time of a schedule and what became of it."""

    due: datetime
    state: str = Field(description="taken: about to be submitted; submitted; refused, see `problem`")
    missed: int = Field(description="earlier due times that nobody was there for; they are not run")
    begun_at: datetime
    study: str | None = Field(description="id of its study; null where there is none, or none any more")
    address: str | None = Field(description="address of the study")
    problem: str | None = Field(description="why no study came of it")


class ScheduleSummary(Body):
    """A study that is submitted by itself."""

    id: str
    name: str
    cron: str | None = Field(description="when it is due again and again, on the wall clock of `zone`")
    at: datetime | None = Field(description="when it is due once")
    zone: str
    window: list[str] | None = Field(description="its studies run between these times of day only")
    priority: int
    fresh: bool
    finish_by: str | None = Field(description="when a run is held, whatever is done: a time of day, or a duration")
    enabled: bool
    created_at: datetime
    next_due: datetime | None = Field(description="null when it is disabled or over")
    last_run: ScheduleRun | None
    links: dict[str, str]


class ScheduleDetail(ScheduleSummary):
    """A schedule with its spec and its latest runs."""

    runs: list[ScheduleRun] = Field(description="latest first")
    spec: dict[str, Any]


class ScheduleList(Body):
    """All schedules, newest first."""

    schedules: list[ScheduleSummary]
