"""Bodies of the answers, as OpenAPI documents them. The answers are built as plain data; tests hold them to these."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

Number = float | int | None


class Body(BaseModel):
    """Base of all: an answer has these fields and no others."""

    model_config = ConfigDict(extra="forbid")


class Interval(Body):
    """An interval, ends included."""

    low: float
    high: float


class Progress(Body):
    """How far a study is."""

    total: int = Field(description="cases of the study")
    done: int = Field(description="cases with an ending")
    ok: int = Field(description="cases that ended ok")


class Passes(Body):
    """What of a study is complete that is run coarse to fine."""

    complete: int = Field(description="passes that are complete")
    total: int = Field(description="passes of the study; the last is the whole study")
    cases: int = Field(description="cases of the complete passes")
    values: list[int] = Field(description="values of each axis in the complete grid; empty where cases are written out")


class FullProgress(Progress):
    """How far a study is, how fast, and how long it will take."""

    endings: dict[str, int] = Field(description="number of cases for each ending")
    rate: float | None = Field(description="cases per second over the recent chunks; null when nothing runs")
    seconds_left: Interval | None = Field(description="estimated time left in s; null when nothing runs")
    in_time: Literal["yes", "no", "unsure"] | None = Field(
        description="whether it will be finished by `finish_by`, from `seconds_left`; null when nothing is known"
    )
    done_by_then: int | None = Field(description="cases that will be done at `finish_by`, about")
    passes: Passes | None = Field(description="of a study that is run coarse to fine: what is complete")


class StudySummary(Body):
    """A study."""

    id: str
    name: str
    model: str
    state: str
    state_meaning: str = Field(description="the state as a sentence")
    reason: str | None = Field(description="why the study is held, waits or failed")
    cases: int = Field(description="number of cases")
    progress: Progress
    reused: int = Field(description="cases whose rows were taken from other studies instead of being run")
    warnings: list[str] = Field(description="what is allowed but probably not meant")
    priority: int = Field(description="of the studies that wait, those of the highest priority go first")
    created_at: datetime
    started_at: datetime | None
    finished_at: datetime | None
    finish_by: datetime | None = Field(description="when the study is held, whatever is done then")
    time_over: bool = Field(description="it is held because `finish_by` came before its end")
    engine_version: str
    links: dict[str, str] = Field(description="addresses of what belongs to the study")


class AxisInfo(Body):
    """An axis of a study."""

    paths: list[str] = Field(description="the parameters that vary together")
    unit: str
    values: int = Field(description="number of values")
    first: float = Field(description="the first value, SI")
    last: float = Field(description="the last value, SI")


class StudyDetail(StudySummary):
    """A study with its spec and its progress."""

    progress: FullProgress
    combine: str = Field(description="grid: every combination, the first axis slowest; zip: the axes go together")
    axes: list[AxisInfo]
    physics_hash: str = Field(description="SHA-256 of what decides the numbers: equal for equal studies")
    regimes: dict[str, int] = Field(description="number of cases of each regime; empty where cases have none")
    spec: dict[str, Any] = Field(description="the spec as it was submitted")


class StudyPage(Body):
    """A page of studies, newest first."""

    studies: list[StudySummary]
    next_page_token: str | None = Field(description="token of the next page; null on the last")


class FitDegree(Body):
    """One degree that a clutch fit tried."""

    degree: int
    rms: float
    max_residual: float
    rank: int
    condition_number: Number
    eigenvalues: list[float]


class ClutchFitReport(Body):
    """A fitted clutch law and how well it fits."""

    coefficients: list[float] = Field(description="c_1 first, N*m/rad^(k-1)")
    windup_limit: float = Field(description="end of the measured data, rad")
    degree: int
    accuracy: float = Field(description="largest residual that was allowed, N*m")
    rms: float = Field(description="root mean square of the residuals, N*m")
    max_residual: float = Field(description="largest residual, N*m")
    residuals: list[float] = Field(description="residual of each row, N*m")
    rows_in_backlash: list[int] = Field(description="rows within the lost motion, left out of the fit")
    condition_number: Number = Field(description="of the normal matrix")
    eigenvalues: list[float] = Field(description="of the normal matrix")
    rank: int
    monotone: bool
    negative: bool
    degrees_tried: list[FitDegree] = Field(description="every degree that was tried")
    warnings: list[str]


class Preview(Body):
    """What a study would be, without submitting it."""

    model: str
    name: str
    cases: int
    shape: list[int] = Field(description="number of values of each axis; of a zip, the common number")
    combine: str
    axes: list[AxisInfo]
    results: int = Field(description="number of results of each case")
    reusable: int = Field(description="cases that need not be run, because other studies of the database have them")
    estimated_seconds: float = Field(description="rough time on the processes of this service, s")
    estimated_bytes: int = Field(description="rough size in the database")
    warnings: list[str]
    fits: dict[str, ClutchFitReport] = Field(description="fitted clutch laws, by JSON Pointer into the spec")
    first_cases: list[dict[str, Any]] = Field(description="parameters of the first cases, SI")


class Case(Body):
    """One case: a row of results."""

    case: int
    parameters: dict[str, float] = Field(description="values of the axes, SI, every tied path")
    ending: str = Field(description="ok, or why not; pending when it has not been run yet")
    flags: list[str]
    results: dict[str, Number | str] = Field(
        description="SI numbers by name, categories by their names; null where it could not be computed"
    )


class CaseDetail(Case):
    """One case with what its ending means."""

    ending_meaning: str
    flag_meanings: dict[str, str]
    links: dict[str, str]


class CasePage(Body):
    """A page of finished cases, in order of their numbers."""

    cases: list[Case]
    next_page_token: str | None = Field(description="token of the next page; null on the last")


class ValueAxis(Body):
    """What instantaneous values stand over."""

    name: str = Field(description="field of the document with its values: times or angles")
    unit: str


class Trajectory(Body):
    """Instantaneous values of one case."""

    case: int
    parameters: dict[str, float]
    axis: ValueAxis = Field(description="what the values stand over")
    times: list[float] = Field(description="s, from the start of the run")
    variables: dict[str, dict[str, str]] = Field(description="unit of each variable")
    values: dict[str, list[Number]] = Field(description="values at the times, by variable")
    states: dict[str, list[str]] = Field(description="states of shaft and clutches at the times")
    ending: str


class AngleTable(Body):
    """Tables of one case of a machine shaft over the angle of the shaft."""

    case: int
    parameters: dict[str, float]
    axis: ValueAxis = Field(description="what the values stand over")
    angles: list[float] = Field(description="rad, from the start of the cycle; none where the case has no motion")
    variables: dict[str, dict[str, str]] = Field(description="unit of each variable")
    values: dict[str, list[Number]] = Field(description="values at the angles, by variable")
    phi_c: list[float] = Field(description="all angles in rad at which the energy is its mean")
    ending: str


class CurveAxis(Body):
    """The axis of a curve."""

    path: str
    unit: str
    values: list[float] = Field(description="ascending; of a zip, in order of the cases")


class ResultMeaning(Body):
    """Unit and meaning of a result."""

    unit: str
    description: str


class Curve(Body):
    """One curve; all its lists are aligned."""

    by: dict[str, float]
    at: dict[str, float]
    x: list[float]
    cases: list[int]
    y: dict[str, list[Number]]
    endings: list[str]
    regime: list[str | None] | None = Field(
        default=None, description="the regime of each case of a settled study; null where it has none"
    )


class Curves(Body):
    """Curves of results over one axis."""

    study: str
    x: CurveAxis
    units: dict[str, str] = Field(description="SI unit of every parameter in x, by and at")
    results: dict[str, ResultMeaning]
    curves: list[Curve]


class MapResult(Body):
    """The result of a map."""

    name: str
    unit: str
    description: str
    values: list[list[Number]] = Field(description="values[j][i] belongs to y.values[j] and x.values[i]")


class Map(Body):
    """One result over two axes."""

    study: str
    x: CurveAxis
    y: CurveAxis
    z: MapResult
    units: dict[str, str] = Field(description="SI unit of every parameter in x, y and at")
    at: dict[str, float]
    cases: list[list[int]]
    endings: list[list[str]]
    regime: list[list[str | None]] | None = Field(
        default=None, description="the regime of each case of a settled study; null where it has none"
    )


class AxisEffect(Body):
    """What one axis does to one result."""

    paths: list[str]
    unit: str
    values: list[Number] = Field(description="values of the axis, or middles of groups of them, SI")
    means: list[Number] = Field(description="mean of the result at each of these values")
    first_order: float | None = Field(description="share of the variance that knowing this axis would take away")
    first_order_error: float | None = Field(description="half width of its 95 % interval; null where it is exact")
    total: float | None = Field(description="share that would stay if everything but this axis were known")
    total_error: float | None = Field(description="half width of its 95 % interval; null where it is exact")


class ResultSensitivity(Body):
    """What one result depends on."""

    result: str
    unit: str
    description: str
    method: str = Field(
        description="grid: exact; saltelli: by the design for it; rbd-fast: from a sample; none: a note says why"
    )
    cases: int = Field(description="cases that have the result")
    missing: int = Field(description="cases that have not")
    mean: float | None
    variance: float | None
    effects: list[AxisEffect]
    notes: list[str]


class SensitivityReport(Body):
    """What results depend on."""

    study: str
    results: list[ResultSensitivity]
    warnings: list[str] = Field(description="axes that change no result; told once the study has ended")


class ParameterInfo(Body):
    """A parameter of a model."""

    path: str = Field(
        description="path in a spec; N is the index of a pendulum, K of a coefficient or a step, NAME a constant"
    )
    symbol: str
    unit: str
    low: float | None = Field(description="least value; null: none")
    low_open: bool = Field(description="whether the least value itself is excluded")
    high: float | None = Field(description="largest value; null: none")
    required: bool
    default: float | None = Field(description="null where it is required, or where the default is no limit")
    range: str
    help: str


class ResultInfo(Body):
    """A result of a model."""

    name: str = Field(description="N stands for a pendulum's index")
    unit: str
    kind: str
    description: str


class Model(Body):
    """A model: its parameters and results, and how its cases can end."""

    name: str
    engine_version: str
    parameters: list[ParameterInfo]
    results: list[ResultInfo]
    endings: dict[str, str]
    flags: dict[str, str]


class ModelList(Body):
    """All models."""

    models: list[Model]


class Preset(Body):
    """A study that comes with the program."""

    name: str
    title: str = Field(description="the name of the study")
    model: str
    shows: str = Field(description="what to look at in it")
    values: str = Field(description="where its numbers come from")
    cases: int
    spec: dict[str, Any] = Field(description="its spec, which can be submitted")


class PresetList(Body):
    """All studies that come with the program."""

    presets: list[Preset]


class Health(Body):
    """Whether the service is up."""

    status: Annotated[str, Field(examples=["ok"])]
    warnings: list[str] | None = Field(None, description="What should be looked at, such as a clock that jumped")
