"""Answers about results: cases, motions, curves, maps, sensitivities."""

from __future__ import annotations

from typing import Annotated, NotRequired

from typing_extensions import TypedDict

from sprag_study.service.answers import Doc, Number, Value


class Case(TypedDict):
    """One case: a row of results."""

    case: int
    parameters: Annotated[
        dict[str, Value],
        Doc("values of the axes, every tied path, and of derived parameters, SI; `sweep` is its direction"),
    ]
    ending: Annotated[str, Doc("ok, or why not; pending when it has not been run yet")]
    flags: list[str]
    results: Annotated[
        dict[str, Number | str],
        Doc("SI numbers by name, categories by their names; null where it could not be computed"),
    ]


class RegimeRow(TypedDict):
    """A regime to which starts of a case come."""

    number: Annotated[int, Doc("0 for the most frequent one")]
    flags: list[str]
    results: Annotated[dict[str, Number | str], Doc("as those of a case")]


class CaseDetail(Case):
    """One case with the meaning of its ending."""

    units: Annotated[dict[str, str], Doc('SI unit of every parameter and number among the results; "1" for none')]
    ending_meaning: str
    flag_meanings: dict[str, str]
    regimes: Annotated[
        list[RegimeRow], Doc("of a case with many starts, a row for each regime, the most frequent first; else empty")
    ]
    links: dict[str, str]


class BasinData(TypedDict):
    """To which regime one case comes from each start of a grid of two initial values."""

    x: Annotated[str, Doc("path of the initial value across")]
    y: Annotated[str, Doc("path of the other one")]
    x_values: Annotated[list[float], Doc("SI")]
    y_values: Annotated[list[float], Doc("SI")]
    numbers: Annotated[list[list[int]], Doc("number of the regime, a row for each y; -1 where a start did not end ok")]
    regimes: Annotated[list[RegimeRow], Doc("the most frequent first, with the main results of each")]


class CasePage(TypedDict):
    """A page of finished cases, in the order that was asked for."""

    cases: list[Case]
    units: Annotated[dict[str, str], Doc('SI unit of every parameter and number among the results; "1" for none')]
    next_page_token: Annotated[str | None, Doc("token of the next page; null on the last")]


class ValueAxis(TypedDict):
    """The axis of instantaneous values."""

    name: Annotated[str, Doc("field of the document with its values: times or angles")]
    unit: str


class TimedValues(TypedDict):
    """Values of one case at some times."""

    times: Annotated[list[float], Doc("s, from the start of the run")]
    variables: Annotated[dict[str, dict[str, str]], Doc("unit of each variable")]
    values: Annotated[dict[str, list[Number]], Doc("values at the times, by variable")]
    states: Annotated[dict[str, list[str]], Doc("states of shaft and clutches at the times")]


class Trajectory(TimedValues):
    """Instantaneous values of one case."""

    case: int
    parameters: dict[str, Value]
    axis: Annotated[ValueAxis, Doc("what the values stand over")]
    ending: str


class AngleTable(TypedDict):
    """Tables of one case of a machine shaft over the angle of the shaft."""

    case: int
    parameters: dict[str, Value]
    axis: Annotated[ValueAxis, Doc("what the values stand over")]
    angles: Annotated[list[float], Doc("rad, from the start of the cycle; none where the case has no motion")]
    variables: Annotated[dict[str, dict[str, str]], Doc("unit of each variable")]
    values: Annotated[dict[str, list[Number]], Doc("values at the angles, by variable")]
    phi_c: Annotated[list[float], Doc("all angles in rad at which the energy is its mean")]
    ending: str


class CurveAxis(TypedDict):
    """The axis of a curve."""

    path: str
    unit: str
    values: Annotated[list[float], Doc("ascending")]


class ResultMeaning(TypedDict):
    """Unit and meaning of a result."""

    unit: str
    description: str


class Jump(TypedDict):
    """A part of a refined curve that is not interpolated, or the step of a sweep in which the motion jumps."""

    low: Annotated[float, Doc("its ends, values of x, SI")]
    high: float
    why: Annotated[
        str, Doc("failed, irregular, regime, order, no_value, steep or sensitive; of a sweep regime, order or orbit")
    ]
    results: Annotated[
        list[str], Doc("the results that are not interpolated there, of those with a requested error; none of a sweep")
    ]


class Stretch(TypedDict):
    """A part of a refined curve in which the motion is irregular: results scatter around the straight lines."""

    low: Annotated[float, Doc("its ends, values of x, SI")]
    high: float
    half_widths: Annotated[
        dict[str, float], Doc("by result: the largest half width of the band around its lines there, in its unit (SI)")
    ]


class Curve(TypedDict):
    """One curve; its lists of points are aligned."""

    by: dict[str, Value]
    at: dict[str, Value]
    x: list[float]
    cases: list[int]
    y: dict[str, list[Number]]
    endings: list[str]
    flags: Annotated[list[list[str]], Doc("flags of each case; a case that had not settled is a missing value")]
    regime: NotRequired[Annotated[list[str | None], Doc("regime of each case of a settled study; null: none")]]
    order: NotRequired[
        Annotated[
            list[int | None], Doc("excitation periods after which the motion of each case repeats; null: it does not")
        ]
    ]
    error: NotRequired[
        Annotated[
            dict[str, float | None],
            Doc(
                "of a refined curve: estimated largest error of straight lines outside `jumps` and `irregular`, "
                "relative to the range, for each result that was asked for; null: not known yet"
            ),
        ]
    ]
    error_absolute: NotRequired[
        Annotated[dict[str, float | None], Doc("of a refined curve: `error` in the units of the results")]
    ]
    jumps: NotRequired[
        Annotated[list[Jump], Doc("of a refined curve: where it is not interpolated; of a sweep: jumps")]
    ]
    irregular: NotRequired[
        Annotated[list[Stretch], Doc("of a refined curve: where results scatter around its lines by a half width")]
    ]
    band: NotRequired[
        Annotated[
            dict[str, list[float | None]],
            Doc(
                "of a refined curve: half width at each point, by result, straight in between; null where none scatters"
            ),
        ]
    ]
    passed: NotRequired[
        Annotated[
            bool,
            Doc(
                "of a refined curve: whether no more points are needed for the requested error, "
                "also where no case has a result"
            ),
        ]
    ]


class AskedError(TypedDict):
    """The requested error of one result."""

    value: float
    absolute: Annotated[bool, Doc("whether it is in the unit of the result (SI); otherwise relative to its range")]


class CurvesData(TypedDict):
    """Curves of results over one axis, without the study."""

    x: CurveAxis
    units: Annotated[dict[str, str], Doc("SI unit of every parameter in x, by and at")]
    results: dict[str, ResultMeaning]
    curves: list[Curve]
    error_asked: NotRequired[
        Annotated[
            float, Doc("of refined curves: the requested error, relative to the range, of results without their own")
        ]
    ]
    errors_asked: NotRequired[
        Annotated[
            dict[str, AskedError], Doc("of refined curves: requested errors of results with an error of their own")
        ]
    ]


class Curves(CurvesData):
    """Curves of results over one axis."""

    study: str


class MapResult(TypedDict):
    """The result of a map."""

    name: str
    unit: str
    description: str
    values: Annotated[list[list[Number]], Doc("values[j][i] belongs to y.values[j] and x.values[i]")]


class MapPoints(TypedDict):
    """The cases of a refined map that have been run; all lists are aligned."""

    x: list[float]
    y: list[float]
    z: list[Number]
    cases: list[int]


class MapData(TypedDict):
    """One result over two axes, without the study."""

    x: CurveAxis
    y: CurveAxis
    z: MapResult
    units: Annotated[dict[str, str], Doc("SI unit of every parameter in x, y and at")]
    at: dict[str, Value]
    cases: Annotated[list[list[int]], Doc("empty for a refined map, whose values are interpolated: see `points`")]
    endings: Annotated[
        list[list[str]], Doc("of a refined map: interpolated; jump, where it must not be interpolated; pending")
    ]
    flags: NotRequired[Annotated[list[list[list[str]]], Doc("flags of each case; not of a refined map")]]
    regime: NotRequired[Annotated[list[list[str | None]], Doc("regime of each case of a settled study; null: none")]]
    order: NotRequired[
        Annotated[
            list[list[int | None]],
            Doc("excitation periods after which the motion of each case repeats; null: it does not"),
        ]
    ]
    points: NotRequired[Annotated[MapPoints, Doc("of a refined map: its cases")]]
    error_asked: NotRequired[
        Annotated[
            float, Doc("of a refined map: the requested error, relative to the range unless `error_asked_absolute`")
        ]
    ]
    error_asked_absolute: NotRequired[
        Annotated[bool, Doc("of a refined map: whether the requested error is in the unit of the result")]
    ]
    error_absolute: NotRequired[Annotated[float | None, Doc("of a refined map: `error` in the unit of the result")]]
    error: NotRequired[
        Annotated[
            float | None,
            Doc("of a refined map: estimated largest error outside jumps, relative to the range; null: not known yet"),
        ]
    ]
    jumps_share: NotRequired[Annotated[float, Doc("of a refined map: share of its area that is not interpolated")]]
    passed: NotRequired[
        Annotated[
            bool,
            Doc(
                "of a refined map: whether no more points are needed for the requested error, "
                "also where no case has a result"
            ),
        ]
    ]


class Map(MapData):
    """One result over two axes."""

    study: str


class AxisEffect(TypedDict):
    """The effect of one axis on one result."""

    paths: list[str]
    unit: str
    values: Annotated[list[Number], Doc("values of the axis, or midpoints of groups of values, SI")]
    means: Annotated[list[Number], Doc("mean of the result at each of these values")]
    first_order: Annotated[float | None, Doc("share of the variance that would vanish if only this axis were fixed")]
    first_order_error: Annotated[float | None, Doc("half width of its 95 % interval; null where it is exact")]
    total: Annotated[float | None, Doc("share that would remain if everything but this axis were fixed")]
    total_error: Annotated[float | None, Doc("half width of its 95 % interval; null where it is exact")]
    mu: Annotated[float | None, Doc("mean elementary effect of the whole range, in the result's unit; morris only")]
    mu_star: Annotated[float | None, Doc("mean of the absolute elementary effects")]
    mu_star_error: Annotated[float | None, Doc("half width of its 95 % interval")]
    sigma: Annotated[float | None, Doc("standard deviation of the elementary effects")]


class PairEffect(TypedDict):
    """The interaction of two axes."""

    paths: list[str]
    other_paths: list[str]
    second_order: Annotated[float | None, Doc("share of the variance by the interaction of these two axes alone")]
    error: Annotated[float | None, Doc("half width of its 95 % interval; null where it is exact")]


class ResultSensitivity(TypedDict):
    """Sensitivity of one result."""

    result: str
    unit: str
    description: str
    method: Annotated[
        str,
        Doc(
            "grid: exact; saltelli: by the design for it; morris: elementary effects; rbd-fast: from a sample; "
            "none: a note says why"
        ),
    ]
    cases: Annotated[int, Doc("cases that have the result")]
    missing: Annotated[int, Doc("cases that do not have it")]
    mean: float | None
    variance: float | None
    effects: list[AxisEffect]
    pairs: Annotated[list[PairEffect], Doc("second-order indices; empty where the method does not give them")]
    notes: list[str]


class SensitivityReport(TypedDict):
    """Sensitivity of results."""

    study: str
    results: list[ResultSensitivity]
    warnings: Annotated[list[str], Doc("axes that change no result; given once the study has ended")]
    warning_codes: Annotated[list[str | None], Doc("the code of each of `warnings`")]


class EngagementRow(TypedDict):
    """One stretch in which a clutch transmits torque."""

    clutch: Annotated[int, Doc("number of its pendulum, from 0")]
    start: Annotated[float, Doc("s")]
    end: Annotated[float, Doc("s")]
    order: Annotated[int, Doc("1: no other clutch transmits torque when it begins; 2: it joins another; and so on")]
    torque_max: Annotated[float, Doc("largest torque, N*m")]
    work_shaft: Annotated[float, Doc("work that the clutch does on the shaft, J")]
    work_pendulum: Annotated[float, Doc("work that the pendulum does on the clutch, J")]
    complete: Annotated[bool, Doc("false where it begins before or continues after the reported part")]
    impact_speed: Annotated[
        float | None,
        Doc("relative speed of pendulum and shaft at its start, rad/s; null where it begins before the reported part"),
    ]
    torque_rate_max: Annotated[float, Doc("largest rate of the torque in magnitude between its jumps, N*m/s")]
    windup_max: Annotated[float, Doc("largest windup, rad")]


class PeriodRow(TypedDict):
    """One excitation period of a run."""

    start: Annotated[float, Doc("s")]
    speed_mean: Annotated[float, Doc("mean speed of the shaft, rad/s")]
    speed_max: Annotated[float, Doc("largest speed of the shaft, rad/s")]
    torque_mean: Annotated[float, Doc("mean torque of all clutches on the shaft, N*m")]


class EngagementTables(TypedDict):
    """The engagements of one case, and the means of its excitation periods."""

    case: int
    parameters: dict[str, Value]
    start: Annotated[float, Doc("start of the reported part, s")]
    end: Annotated[float, Doc("its end, s: after one turn of a periodic motion, or at the end of the window")]
    regime: Annotated[str | None, Doc("regime of the settled motion; null for a run of a given time")]
    engagements: list[EngagementRow]
    periods: Annotated[list[PeriodRow], Doc("whole excitation periods")]
    ending: str


class ClutchDutyRow(TypedDict):
    """What one clutch has to bear."""

    clutch: Annotated[int, Doc("number of its pendulum, from 0")]
    engagements_per_hour: float
    torque_max: Annotated[float, Doc("largest torque that it transmits, N*m")]
    torque_rate_max: Annotated[float, Doc("largest rate of that torque in magnitude between its jumps, N*m/s")]
    torque_jump_max: Annotated[float, Doc("largest jump of that torque, N*m")]
    impact_speed_max: Annotated[
        float, Doc("largest relative speed of pendulum and shaft at the start of an engagement, rad/s")
    ]
    overrunning_speed_max: Annotated[float, Doc("largest relative speed at which it overruns, rad/s")]
    windup_min: Annotated[float, Doc("smallest windup while it transmits torque, rad")]
    windup_max: Annotated[float, Doc("largest windup, rad")]
    slip_work_per_hour: Annotated[
        float,
        Doc(
            "work that it turns into heat in an hour, J: by its damping, by its drag while it overruns, and the energy "
            "of its spring where it opens wound up"
        ),
    ]
    cycles_per_hour: Annotated[float, Doc("cycles of its torque by rainflow counting")]
    torque_equivalent: Annotated[
        float | None,
        Doc(
            "torque that, reached from zero once in each engagement, does the same damage, N*m; null without an "
            "`exponent`, and where it does not engage"
        ),
    ]
    torque_margin: Annotated[float | None, Doc("rated torque / largest torque; null without a rating or a load")]
    frequency_margin: Annotated[
        float | None, Doc("rated indexing frequency / engagements per time; null without a rating or a load")
    ]
    speed_margin: Annotated[float | None, Doc("rated overrunning speed / largest one; null without a rating or a load")]


class TorqueCyclesRow(TypedDict):
    """Cycles of the torque of one clutch that are alike."""

    clutch: Annotated[int, Doc("number of its pendulum, from 0")]
    range: Annotated[float, Doc("difference between peak and valley, N*m")]
    mean: Annotated[float, Doc("mean of peak and valley, N*m")]
    count: Annotated[float, Doc("cycles in the reported part; a half cycle counts as 0.5")]
    per_hour: Annotated[float, Doc("cycles per hour")]


class DutyTables(TypedDict):
    """What the clutches of one case have to bear, and the cycles of their torques."""

    case: int
    parameters: dict[str, Value]
    start: Annotated[float, Doc("start of the reported part, s")]
    end: Annotated[float, Doc("its end, s: after one turn of a periodic motion, or at the end of the window")]
    regime: Annotated[str | None, Doc("regime of the settled motion; null for a run of a given time")]
    exponent: Annotated[
        float | None, Doc("exponent of the Wöhler curve that was asked for; null: those of the machine, if any")
    ]
    clutches: list[ClutchDutyRow]
    cycles: Annotated[list[TorqueCyclesRow], Doc("of each clutch, the largest ranges first")]
    ending: str


class Portrait(TypedDict):
    """How one case approaches its motion: its state once per excitation period, and its orbit."""

    case: int
    parameters: dict[str, Value]
    regime: Annotated[str | None, Doc("regime of the settled motion; null for a run of a given time")]
    order: Annotated[int | None, Doc("excitation periods in one turn of the orbit; null where there is none")]
    strobes: Annotated[TimedValues, Doc("at the ends of the excitation periods, from the start of the run")]
    orbit: Annotated[
        TimedValues | None,
        Doc("one whole turn of the settled motion, from the start of an excitation period; null where there is none"),
    ]
    ending: str


class BranchContact(TypedDict):
    """How often a part of the machine is in a state in one turn, on the two sides of a grazing."""

    part: str
    state: str
    before: int
    after: int


class BranchSpecial(TypedDict):
    """A special point of a branch."""

    kind: Annotated[str, Doc("fold, doubling, torus, branching or grazing")]
    meaning: str
    parameter: Annotated[float, Doc("where it is, SI")]
    index: Annotated[int, Doc("its place among the points; of a grazing, the last point before it")]
    multipliers: Annotated[list[list[float]], Doc("real and imaginary part of each multiplier, the largest first")]
    contacts: Annotated[list[BranchContact], Doc("of a grazing, which events appear or disappear")]


class Branch(TypedDict):
    """The branch of orbits through the settled motion of one case, in order along the branch."""

    case: int
    parameters: dict[str, Value]
    along: Annotated[list[str], Doc("paths that have the value of the branch's parameter")]
    unit: Annotated[str, Doc("SI unit of the parameter")]
    low: Annotated[float, Doc("start of the range, SI")]
    high: Annotated[float, Doc("end of the range, SI")]
    value: Annotated[float, Doc("the parameter in the case, SI")]
    order: Annotated[int | None, Doc("excitation periods in one turn of each orbit; null where there is no branch")]
    parameter: Annotated[list[float], Doc("the parameter at each point, SI")]
    stable: Annotated[list[bool], Doc("whether the motion of each point is stable")]
    multiplier: Annotated[list[float], Doc("largest modulus of the multipliers of each point")]
    variables: Annotated[dict[str, dict[str, str]], Doc("unit of each result")]
    values: Annotated[dict[str, list[Number]], Doc("results over one turn of each point")]
    specials: list[BranchSpecial]
    ends: Annotated[list[str], Doc("why the branch ends before its first point, and after its last one")]
    note: Annotated[str | None, Doc("why there is no branch; null where there is one")]
