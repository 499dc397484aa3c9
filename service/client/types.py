"""Answers of the service as typed dictionaries: the fields that programs use most; an answer may have more."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NotRequired, TypedDict


class Progress(TypedDict):
    """How far a study is: cases in all, with an ending, and ended ok."""

    total: int
    done: int
    ok: int


class SecondsLeft(TypedDict):
    """Interval of the time left, s."""

    low: float
    high: float


class FullProgress(Progress):
    """The same, with endings, cases a second, and time left."""

    endings: dict[str, int]
    rate: float | None
    seconds_left: SecondsLeft | None
    in_time: str | None
    done_by_then: int | None
    passes: dict[str, Any] | None


class StudySummary(TypedDict):
    """A study without its spec. Times are RFC 3339 texts in UTC."""

    id: str
    name: str
    model: str
    state: str
    state_meaning: str
    reason: str | None
    cases: int
    reused: int
    warnings: list[str]
    engine_version: str
    created_at: str
    started_at: str | None
    finished_at: str | None
    finish_by: str | None
    time_over: bool


class StudyDetail(StudySummary):
    """A study with everything."""

    progress: FullProgress
    combine: str
    axes: list[dict[str, Any]]
    physics_hash: str
    spec: dict[str, Any]


class Preview(TypedDict):
    """What a study would be; times in s."""

    cases: int
    reusable: int
    estimated_seconds: float
    estimated_bytes: int
    warnings: list[str]
    first_cases: list[dict[str, Any]]


class CurveAxis(TypedDict):
    """The axis of curves, SI."""

    path: str
    unit: str
    values: list[float]


class Curve(TypedDict):
    """One curve; all its lists are aligned."""

    by: dict[str, float]
    at: dict[str, float]
    x: list[float]
    cases: list[int]
    y: dict[str, list[float | None]]
    endings: list[str]
    regime: NotRequired[list[str | None]]


class CurvesData(TypedDict):
    """Curves as the service answers them."""

    study: str
    x: CurveAxis
    units: dict[str, str]
    results: dict[str, dict[str, str]]
    curves: list[Curve]


class Case(TypedDict):
    """One case; null results are None."""

    case: int
    parameters: dict[str, float]
    ending: str
    flags: list[str]
    results: dict[str, float | str | None]


Spec = Mapping[str, Any]
