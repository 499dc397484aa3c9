"""What each view of a study is asked. Loading this module loads no engine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final, Literal

from annotated_types import Interval

from sprag_study.service.languages import N_
from sprag_study.service.views.setting import Setting, ViewInfo
from sprag_study.worker.codes import ENDING_CODES, FLAG_MASKS, PENDING, REGIME_CODES
from sprag_study.worker.limits import (
    MAX_DESIGNS,
    MAX_PAGE_SIZE,
    MAX_PAGE_TOKEN,
    MAX_POINTS_SELECTED,
    MAX_QUANTILES,
    MAX_SELECTED,
    MAX_STARTS,
    MAX_WORST,
)

_ENDINGS: Final = tuple(name for name in ENDING_CODES if name != PENDING)
_REGIMES: Final = tuple(REGIME_CODES)
_FLAGS: Final = tuple(FLAG_MASKS)

Held = Annotated[
    list[str] | None,
    Setting(
        "`path=value`: the value at which another axis is held, SI or with a unit; may be repeated",
        examples=(["excitation.frequency=16 Hz"],),
        metavar="PATH=VALUE",
    ),
]
Of = Annotated[
    list[str] | None,
    Setting(
        "`path=value`, such as excitation.frequency=16 Hz: a value of an axis of `by` that has a curve; may be "
        "repeated; default: all of them",
        metavar="PATH=VALUE",
    ),
]
Point = Annotated[
    str | None,
    Setting(
        "working point: a value of the axis along the curves, SI or with a unit; between two cases its results are "
        "interpolated where a line joins these; default: the value of the base",
        examples=("0.3 N*m",),
        longest=100,
    ),
]
Number = Annotated[
    int,
    Setting(
        "of cases with many starts, the number of the regime; 0 is the most frequent one of each case",
        low=0,
        high=MAX_STARTS,
        metavar="N",
    ),
]
LineBy = Annotated[
    list[str] | None,
    Setting("axis with one line for each of its values; may be repeated", metavar="PATH", label=N_("A line for each")),
]
CurveBy = Annotated[
    list[str] | None,
    Setting(
        "axis with one curve for each of its values; may be repeated",
        examples=(["excitation.frequency"],),
        metavar="PATH",
    ),
]
LineAlong = Annotated[
    str | None,
    Setting(
        "path of the axis along the lines; default: that of the curves",
        examples=("shaft.load",),
        metavar="PATH",
        label=N_("Along"),
    ),
]
Ending = Annotated[str | None, Setting("only cases with this ending", least=1, longest=40, metavar="ENDING")]
Regime = Annotated[
    str | None, Setting("only cases of this regime, of a settled study", least=1, longest=40, metavar="REGIME")
]
Flag = Annotated[str | None, Setting("only cases with this flag", least=1, longest=40, metavar="FLAG")]
Result = Annotated[
    list[str] | None,
    Setting(
        "result; may be repeated; default: those of the page",
        examples=(["shaft.speed.mean"],),
        metavar="RESULT",
        label=N_("Results"),
    ),
]


@dataclass(frozen=True, slots=True)
class CurvesQuestion:
    """Which results, along which axis, with a curve for which values, and where the other axes are held."""

    x: Annotated[
        str | None,
        Setting(
            "path of the axis along the curve; default: that of the page", examples=("shaft.load",), metavar="PATH"
        ),
    ] = None
    y: Annotated[
        list[str] | None,
        Setting(
            "result to draw; may be repeated; default: those of the page",
            examples=(["shaft.speed.mean"],),
            metavar="RESULT",
        ),
    ] = None
    by: CurveBy = None
    at: Held = None
    of: Of = None
    rest: Annotated[
        Literal["given", "usual"],
        Setting(
            "axes that are neither drawn nor in `at`: `given` refuses them, `usual` holds them at their usual value, "
            "as pages do"
        ),
    ] = "given"
    number: Number = 0


@dataclass(frozen=True, slots=True)
class MapQuestion:
    """Which result, over which two axes, and where the others are held."""

    x: Annotated[str, Setting("path of the axis along the curve", examples=("shaft.load",), metavar="PATH")]
    y: Annotated[str, Setting("path of the other axis", examples=("excitation.frequency",), metavar="PATH")]
    z: Annotated[str, Setting("the result", examples=("shaft.speed.mean",), metavar="RESULT")]
    at: Held = None
    number: Number = 0
    kind: Annotated[
        Literal["heatmap", "contour"], Setting("of a picture: colours, or lines of equal value", of_files=True)
    ] = "heatmap"


@dataclass(frozen=True, slots=True)
class AnswersQuestion:
    """Of which curves, and at which working point."""

    point: Point = None
    x: Annotated[
        str | None,
        Setting(
            "path of the axis along the curves; default: that of the page", examples=("shaft.load",), metavar="PATH"
        ),
    ] = None
    by: Annotated[
        list[str] | None, Setting("axis with one curve for each of its values; may be repeated", metavar="PATH")
    ] = None
    at: Held = None
    of: Of = None


Where = Annotated[
    list[str] | None,
    Setting(
        "`NAME >= VALUE` or `NAME <= VALUE` of a parameter that varies or a numeric result, SI or with a unit; may "
        "be repeated: all must hold",
        examples=(["shaft.load <= 2 N*m"],),
        metavar="RANGE",
    ),
]
Sort = Annotated[
    str,
    Setting(
        'parameter, result, "case", "ending", "flags" or "regime" to sort all rows by; "-" before it: from the '
        "largest down; cases without it come last",
        examples=("-efficiency",),
        longest=100,
        metavar="SORT",
    ),
]


@dataclass(frozen=True, slots=True)
class CasesQuestion:
    """Which page of which cases, in which order."""

    page_size: Annotated[int, Setting("most cases on the page", low=1, high=MAX_PAGE_SIZE, metavar="N")] = 100
    page_token: Annotated[
        str | None, Setting("`next_page_token` of the page before", least=1, longest=MAX_PAGE_TOKEN)
    ] = None
    ending: Annotated[
        str | None,
        Setting(
            "only cases with this ending",
            examples=("ok",),
            choices=_ENDINGS,
        ),
    ] = None
    regime: Annotated[
        str | None,
        Setting(
            "only cases of this regime, of a settled study",
            choices=_REGIMES,
        ),
    ] = None
    flag: Annotated[
        str | None, Setting("only cases that have this flag", examples=("not_settled",), choices=_FLAGS)
    ] = None
    where: Where = None
    at: Annotated[
        list[str] | None,
        Setting(
            "`path=value`: only cases with this value of an axis, SI or with a unit; may be repeated",
            examples=(["shaft.load=0.1 N*m"],),
            metavar="PATH=VALUE",
        ),
    ] = None
    sort: Sort = "case"


@dataclass(frozen=True, slots=True)
class SelectionQuestion:
    """Which cases, in which order."""

    where: Where = None
    ending: Ending = None
    regime: Regime = None
    flag: Flag = None
    sort: Sort = "case"


@dataclass(frozen=True, slots=True)
class ExploreQuestion(SelectionQuestion):
    """Which cases, in which order, how many, and which quantities are shown of them."""

    limit: Annotated[int, Setting("most rows", examples=(10,), low=1, high=MAX_SELECTED, metavar="N")] = 50
    show: Annotated[
        list[str] | None,
        Setting(
            "quantity of histograms and rows; may be repeated; default: axes and the model's main results",
            examples=(["efficiency"],),
            metavar="NAME",
        ),
    ] = None
    x: Annotated[
        str, Setting("of a picture: shown quantity to the right", longest=100, metavar="NAME", of_files=True)
    ] = ""
    y: Annotated[str, Setting("of a picture: the same upwards", longest=100, metavar="NAME", of_files=True)] = ""


@dataclass(frozen=True, slots=True)
class RibbonQuestion:
    """Which quantiles of which results, along which axis."""

    x: LineAlong = None
    y: Result = None
    by: LineBy = None
    at: Held = None
    quantiles: Annotated[
        list[Annotated[float, Interval(gt=0.0, lt=1.0)]] | None,
        Setting(
            "probability of a quantile; may be repeated; default: 0.05, 0.5 and 0.95",
            examples=([0.05, 0.5, 0.95],),
            alias="quantile",
            longest=MAX_QUANTILES,
            metavar="P",
            label=N_("Quantiles"),
        ),
    ] = None
    mapped: Annotated[
        bool, Setting("of a picture: a map of the quantile over `x` and `by`", alias="map", of_files=True)
    ] = False


@dataclass(frozen=True, slots=True)
class YieldQuestion:
    """Which conditions, along which axis, and how many of the worst drives."""

    conditions: Annotated[
        list[str],
        Setting(
            "`RESULT >= VALUE`, `<=` or `=`, the value with a unit or as `N % of nominal`; may be repeated: all must "
            "hold",
            examples=(["shaft.speed.mean >= 90 % of nominal"],),
            alias="condition",
            least=1,
            metavar="CONDITION",
            positional=True,
            label=N_("What a good drive reaches"),
        ),
    ]
    x: LineAlong = None
    by: LineBy = None
    at: Held = None
    worst: Annotated[int, Setting("most drives in the list of the worst", low=0, high=MAX_WORST, metavar="N")] = 10
    mapped: Annotated[
        bool, Setting("of a picture: a map of the yield over `x` and `by`", alias="map", of_files=True)
    ] = False


@dataclass(frozen=True, slots=True)
class FrontQuestion:
    """Which designs, how many, and what a picture shows."""

    limit: Annotated[int, Setting("most designs", examples=(100,), low=1, high=MAX_DESIGNS, metavar="N")] = 2000
    exact: Annotated[bool, Setting("designs must meet equalities of real numbers to 1e-6 to be feasible")] = False
    x: Annotated[
        str | None,
        Setting("of a picture: goal, variable or limited result to the right", metavar="NAME", of_files=True),
    ] = None
    y: Annotated[
        str | None, Setting("of a picture: the same upwards; by default two goals", metavar="NAME", of_files=True)
    ] = None


@dataclass(frozen=True, slots=True)
class CalibrationQuestion:
    """Nothing: a calibration has one answer."""


@dataclass(frozen=True, slots=True)
class SensitivityQuestion:
    """Of which results."""

    y: Annotated[
        list[str],
        Setting(
            "result; may be repeated", examples=(["shaft.speed.mean"],), least=1, metavar="RESULT", label=N_("Results")
        ),
    ]


def _particular(name: str) -> Setting:
    return Setting(f"{name}, in the title block", longest=200, metavar="TEXT")


#: What the appendix of a report can have, in its order.
CHAPTERS: Final = (
    "warnings",
    "answers",
    "axes",
    "curves",
    "drawings",
    "clutch",
    "sensitivity",
    "calibration",
    "drives",
    "endings",
    "ranges",
    "inputs",
    "given",
    "versions",
    "results",
)


@dataclass(frozen=True, slots=True)
class ReportQuestion:
    """What the title block says, which curves are drawn, what its author writes, and what the appendix has."""

    project: Annotated[str, _particular("project")] = ""
    customer: Annotated[str, _particular("customer")] = ""
    quote: Annotated[str, _particular("number of the quote")] = ""
    author: Annotated[str, _particular("author")] = ""
    number: Annotated[str, _particular("number of the document")] = ""
    revision: Annotated[str, _particular("revision of the document")] = ""
    date: Annotated[str | None, _particular("date, today if there is none")] = None
    text: Annotated[
        list[str] | None,
        Setting(
            "text of the author; may be repeated: beside the drawing, below the curves, above what is said of trust, "
            "and before each further figure",
            metavar="TEXT",
        ),
    ] = None
    appendix: Annotated[
        list[str] | None,
        Setting(
            f"chapter after the two pages; may be repeated: {', '.join(CHAPTERS)}; `all` for all of them",
            examples=(["inputs", "versions"],),
            metavar="CHAPTER",
        ),
    ] = None
    x: Annotated[str | None, Setting("path of the axis along the chosen curves", metavar="PATH")] = None
    by: Annotated[list[str] | None, Setting("axis with one curve for each of its values", metavar="PATH")] = None
    at: Held = None
    of: Of = None
    y: Annotated[list[str] | None, Setting("result of a chosen curve; may be repeated", metavar="RESULT")] = None
    curve: Annotated[
        str,
        Setting("name of the curve that is meant, such as `2 mm`; default: the usual one", longest=200, metavar="NAME"),
    ] = ""
    point: Point = None


@dataclass(frozen=True, slots=True)
class SelectQuestion(SelectionQuestion):
    """Which cases, in which order, and how many."""

    limit: Annotated[int, Setting("most cases", examples=(10,), low=1, high=MAX_POINTS_SELECTED, metavar="N")] = 50


CURVES: Final = ViewInfo(
    "curves",
    CurvesQuestion,
    "Results against one axis. An axis of several values that is neither x nor "
    "in `by` needs its value in `at`, or `rest=usual`.\n\n"
    "Without `x` or `y` they are the curves that the page of the study shows first. Refined curves tell their error "
    "and their jumps.",
    leading=2,
)
MAP: Final = ViewInfo("map", MapQuestion, "One result over two axes.", leading=3)
ANSWERS: Final = ViewInfo(
    "answers",
    AnswersQuestion,
    "The main answers of a study: no-load speed, largest power, best efficiency, stall torque, a working point.",
    leading=2,
)
EXPLORE: Final = ViewInfo(
    "explore",
    ExploreQuestion,
    "Cases within ranges of parameters and results, sorted over all rows, with a histogram of each quantity.",
    leading=1,
)
RIBBON: Final = ViewInfo(
    "ribbon",
    RibbonQuestion,
    "Quantiles of results over the drives along an axis, with 95 % intervals, the nominal drive, and the causes.",
    leading=2,
    title=N_("What do tolerances do?"),
    note=N_("Quantiles over the drives, and the drive as drawn. A click on one of its points opens its case."),
)
YIELD: Final = ViewInfo(
    "yield",
    YieldQuestion,
    "The share of drives that reach conditions, at each place and at all places, its causes, and the worst drives.",
    leading=2,
    title=N_("How many drives are good"),
)
FRONT: Final = ViewInfo(
    "front",
    FrontQuestion,
    "The designs of a study with a goal, the best first: variables, goals, limits, ranks, and the search's history.",
    leading=1,
)
CALIBRATION: Final = ViewInfo(
    "calibration",
    CalibrationQuestion,
    "The results of a calibration: values with intervals, correlations, residuals, the next point to measure.",
    title=N_("Does it match the measurement?"),
    note=N_(
        "Measured points, the fit and its 95 % interval; beside them the residuals, measured less fitted, in standard "
        "deviations."
    ),
)
SENSITIVITY: Final = ViewInfo(
    "sensitivity",
    SensitivityQuestion,
    "Main effects of every axis on results, and shares of their variance (Sobol indices) or elementary effects.",
    leading=1,
    title=N_("What matters most?"),
    note=N_("The mean of each result along each axis, over all that the others do."),
)
#: Every view of a study, in the order of the API.
STUDY_VIEWS: Final = (CURVES, MAP, SENSITIVITY, RIBBON, YIELD, CALIBRATION, FRONT, EXPLORE, ANSWERS)
