"""Answers about studies: summaries, details, previews, clutch fits."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, Any, Literal, NotRequired

from typing_extensions import TypedDict

from sprag_study.service.answers import Doc, Moment, Number


class StudyOrder(StrEnum):
    """Orders of a list of studies; those that are equal in it are newest first."""

    NEWEST = "newest"
    NAME = "name"
    STATE = "state"
    CASES = "cases"
    ENDED = "ended"


class Interval(TypedDict):
    """An interval, ends included."""

    low: float
    high: float


class Progress(TypedDict):
    """Progress of a study."""

    total: Annotated[int, Doc("cases of the study")]
    done: Annotated[int, Doc("cases with an ending")]
    ok: Annotated[int, Doc("cases that ended ok")]


class Passes(TypedDict):
    """The complete part of a study that is run coarse to fine."""

    complete: Annotated[int, Doc("passes that are complete")]
    total: Annotated[int, Doc("passes of the study; the last is the whole study")]
    cases: Annotated[int, Doc("cases of the complete passes")]
    values: Annotated[list[int], Doc("values of each axis in the complete grid; empty where cases are written out")]


class Rounds(TypedDict):
    """Rounds of a study that chooses its own cases."""

    round: Annotated[int, Doc("number of the round that is being run, from 1; of an ended study, of all rounds")]
    most: Annotated[int, Doc("there are never more rounds")]
    most_cases: Annotated[int, Doc("there are never more cases")]
    sentence: Annotated[str, Doc("for people: round, error now, error asked for")]
    state: Annotated[dict[str, Any], Doc("what the rounds before show, in single values; `rounds` has all of it")]


class Round(TypedDict):
    """One round of a study."""

    round: Annotated[int, Doc("its number, from 1")]
    first_case: Annotated[int, Doc("number of its first case")]
    cases: Annotated[int, Doc("number of its cases; 0 for the end of the study")]
    planned_at: Moment
    summary: Annotated[dict[str, Any], Doc("what the rounds before it show")]


class RoundList(TypedDict):
    """All rounds of a study."""

    study: str
    rounds: list[Round]


class FullProgress(Progress):
    """Progress of a study, its rate and its time left."""

    endings: Annotated[dict[str, int], Doc("number of cases for each ending")]
    rate: Annotated[float | None, Doc("cases per second over the recent chunks; null when nothing runs")]
    seconds_left: Annotated[Interval | None, Doc("estimated time left in s; null when nothing runs")]
    in_time: Annotated[
        Literal["yes", "no", "unsure"] | None,
        Doc("whether it will be finished by `finish_by`, from `seconds_left`; null when unknown"),
    ]
    done_by_then: Annotated[int | None, Doc("estimated number of cases done at `finish_by`")]
    passes: Annotated[Passes | None, Doc("the complete part of a study that is run coarse to fine")]
    rounds: Annotated[Rounds | None, Doc("rounds of a study that chooses its own cases; its `total` grows with them")]


class _Study(TypedDict):
    id: str
    name: str
    model: str
    state: str
    state_meaning: Annotated[str, Doc("the state as a sentence")]
    reason: Annotated[str | None, Doc("why the study is held, waits or failed")]
    cases: Annotated[int, Doc("number of cases")]
    reused: Annotated[int, Doc("cases whose rows were copied from other studies instead of being run")]
    warnings: Annotated[list[str], Doc("warnings about what is allowed but probably unintended")]
    warning_codes: Annotated[list[str | None], Doc("the code of each of `warnings`; null in studies of older versions")]
    priority: Annotated[int, Doc("waiting studies with the highest priority run first")]
    created_at: Moment
    started_at: Moment | None
    finished_at: Moment | None
    finish_by: Annotated[Moment | None, Doc("when the study is held, finished or not")]
    time_over: Annotated[bool, Doc("whether it is held because `finish_by` has passed")]
    engine_version: str
    owner: Annotated[str | None, Doc("user to whom it belongs; null: no owner, so every designer can change it")]
    notes: Annotated[str, Doc("what people write about it, plain text")]
    tags: Annotated[list[str], Doc("its tags, in the order in which they came")]
    archived_at: Annotated[Moment | None, Doc("since when it is kept out of the usual list")]
    purge_at: Annotated[Moment | None, Doc("until when it can be restored, if it is deleted")]
    etag: Annotated[str, Doc("edition of name, notes, tags and archive, for `If-Match`")]
    links: Annotated[dict[str, str], Doc("URLs of the study's resources")]


class StudySummary(_Study):
    """A study."""

    progress: Progress


class AxisInfo(TypedDict):
    """An axis of a study."""

    paths: Annotated[list[str], Doc("the parameters that vary together")]
    unit: str
    values: Annotated[int, Doc("number of values; of a study that chooses its own cases, of different ones so far")]
    first: Annotated[float, Doc("the first value, SI; of a study that chooses its own cases, the least")]
    last: Annotated[float, Doc("the last value, SI; of a study that chooses its own cases, the largest")]
    least: Annotated[float, Doc("the least value, SI")]
    largest: Annotated[float, Doc("the largest value, SI")]
    names: NotRequired[
        Annotated[list[str], Doc("names of the components, whose numbers are the values; left out: no components")]
    ]


class Origin(TypedDict):
    """Finished chunks of a study that the same hosts computed, under one fingerprint."""

    host: Annotated[
        str | None,
        Doc("also of rows that were copied from other studies; several with commas; null where not recorded"),
    ]
    fingerprint: Annotated[
        str | None,
        Doc("SHA-256 of code and libraries: equal ones give equal bits; null where not recorded"),
    ]
    chunks: int
    cases: Annotated[int, Doc("cases of these chunks, including those copied from other studies of the fingerprint")]
    differs: Annotated[
        str | None,
        Doc("how the fingerprint differs from the first one of the study; null where it does not, or is not known"),
    ]


class StudyDetail(_Study):
    """A study with its spec and its progress."""

    progress: FullProgress
    combine: Annotated[str, Doc("grid: every combination, the first axis slowest; zip: the axes side by side")]
    axes: list[AxisInfo]
    derive: Annotated[dict[str, str], Doc("derived parameters: path and formula, in SI numbers")]
    physics_hash: Annotated[str, Doc("SHA-256 of everything that determines the results: equal for equal studies")]
    regimes: Annotated[dict[str, int], Doc("number of cases of each regime; empty where cases have none")]
    flags: Annotated[dict[str, int], Doc("number of cases that have each flag; only flags that some case has")]
    computed_by: Annotated[list[Origin], Doc("where the rows come from, most cases first")]
    spec: Annotated[dict[str, Any], Doc("the spec as it was submitted")]


class StudyPage(TypedDict):
    """A page of studies in the order that was asked for."""

    studies: list[StudySummary]
    next_page_token: Annotated[str | None, Doc("token of the next page; null on the last")]


class FitDegree(TypedDict):
    """One degree that a clutch fit tried."""

    degree: int
    rms: float
    max_residual: float
    rank: int
    condition_number: Number
    eigenvalues: list[float]


class ClutchFitReport(TypedDict):
    """A fitted clutch law and how well it fits."""

    coefficients: Annotated[list[float], Doc("c_1 first, N*m/rad^(k-1)")]
    windup_limit: Annotated[float, Doc("end of the measured data, rad")]
    degree: int
    accuracy: Annotated[float, Doc("largest residual that was allowed, N*m")]
    rms: Annotated[float, Doc("root mean square of the residuals, N*m")]
    max_residual: Annotated[float, Doc("largest residual, N*m")]
    residuals: Annotated[list[float], Doc("residual of each row, N*m")]
    rows_in_backlash: Annotated[list[int], Doc("rows within the backlash, left out of the fit")]
    condition_number: Annotated[Number, Doc("of the normal matrix")]
    eigenvalues: Annotated[list[float], Doc("of the normal matrix")]
    rank: int
    monotone: bool
    negative: bool
    degrees_tried: Annotated[list[FitDegree], Doc("every degree that was tried")]
    warnings: list[str]
    warning_codes: Annotated[list[str | None], Doc("the code of each of `warnings`")]


class Preview(TypedDict):
    """Preview of a study that is not submitted."""

    model: str
    name: str
    cases: Annotated[int, Doc("number of cases; of a study that chooses its own cases, those of its first round")]
    most_cases: Annotated[int, Doc("cases at most, all rounds together")]
    most_rounds: Annotated[int, Doc("rounds at most; 1 where the cases are given")]
    shape: Annotated[list[int], Doc("number of values of each axis; of a zip, the common number")]
    combine: str
    axes: list[AxisInfo]
    derive: Annotated[dict[str, str], Doc("derived parameters: path and formula, in SI numbers")]
    results: Annotated[int, Doc("number of results of each case")]
    reusable: Annotated[int, Doc("cases that need not be run, because other studies of the database have them")]
    estimated_seconds: Annotated[float, Doc("rough time of `most_cases` on the processes of this service, s")]
    estimated_bytes: Annotated[int, Doc("rough size of `most_cases` in the database")]
    warnings: list[str]
    warning_codes: Annotated[list[str | None], Doc("the code of each of `warnings`")]
    fits: Annotated[dict[str, ClutchFitReport], Doc("fitted clutch laws, by JSON Pointer into the spec")]
    first_cases: Annotated[list[dict[str, Any]], Doc("parameters of the first cases, SI")]
