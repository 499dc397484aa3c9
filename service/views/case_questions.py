"""What each view of a case is asked. Loading this module loads no engine: the commands read their options from here."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

from sprag.service.views.setting import Setting, ViewInfo
from sprag.worker.limits import (
    MAX_BASIN_POINTS,
    MAX_DIAGRAM_STROBES,
    MAX_DIAGRAM_VALUES,
    MAX_SECTION_STROBES,
    MAX_TRAJECTORY_POINTS,
    MIN_TRAJECTORY_POINTS,
)

Along = Annotated[
    str,
    Setting(
        "path of the parameter, or several joined by commas that have one value",
        examples=("shaft.load",),
        longest=400,
        metavar="PATH",
    ),
]
Low = Annotated[
    str | None, Setting("start of the range, SI or with a unit; by default the smallest on its axis", alias="from")
]
High = Annotated[str | None, Setting("end of the range; by default the largest on its axis", alias="to")]
Phase = Annotated[
    str | None,
    Setting(
        "phase of the excitation at the strobes, rad or with a unit; by default 0",
        examples=("90 deg",),
        metavar="ANGLE",
    ),
]
End = Annotated[str | None, Setting("SI or with a unit; by default as in the study's starts", longest=80)]


@dataclass(frozen=True, slots=True)
class TrajectoryQuestion:
    """Which part of a motion, and at how many places."""

    begin: Annotated[
        str | None,
        Setting(
            "first time, in s or with a unit (s, periods), or angle, in rad or with a unit; by default 0, of a settled "
            "study `max_period` periods before the end",
            alias="from",
            examples=("0",),
            metavar="TIME",
        ),
    ] = None
    end: Annotated[
        str | None,
        Setting(
            "last time or angle, with the same units; by default the end of the run (`at_most` of a settled study) or "
            "cycle",
            alias="to",
            examples=("2.5 periods",),
            metavar="TIME",
        ),
    ] = None
    points: Annotated[
        int,
        Setting(
            "equally spaced times or angles",
            examples=(50,),
            low=MIN_TRAJECTORY_POINTS,
            high=MAX_TRAJECTORY_POINTS,
            metavar="N",
        ),
    ] = 1000


@dataclass(frozen=True, slots=True)
class EngagementsQuestion:
    """Which table."""

    table: Annotated[
        str,
        Setting(
            "the table of a CSV file; JSON has both", choices=("engagements", "periods"), metavar="TABLE", of_files=True
        ),
    ] = "engagements"


@dataclass(frozen=True, slots=True)
class StrobesQuestion:
    """Which table."""

    table: Annotated[
        str,
        Setting(
            "the table of a CSV file; JSON and pictures have both",
            choices=("strobes", "orbit"),
            metavar="TABLE",
            of_files=True,
        ),
    ] = "strobes"


@dataclass(frozen=True, slots=True)
class BranchQuestion:
    """Along which parameter, how far, and the result of a picture."""

    along: Along
    low: Low = None
    high: High = None
    y: Annotated[str | None, Setting("the result that a picture shows", metavar="RESULT", of_files=True)] = None


@dataclass(frozen=True, slots=True)
class DiagramQuestion:
    """Along which parameter, how far, at which phase, how many values and strobes, and the variable of a picture."""

    along: Along
    low: Low = None
    high: High = None
    phase: Phase = None
    points: Annotated[
        int,
        Setting(
            "equally spaced values of the parameter",
            examples=(20,),
            low=2,
            high=MAX_DIAGRAM_VALUES,
            option="--values",
            metavar="N",
        ),
    ] = 200
    strobes: Annotated[
        int, Setting("most strobes of each motion", examples=(16,), low=1, high=MAX_DIAGRAM_STROBES, metavar="N")
    ] = 64
    y: Annotated[str | None, Setting("the variable that a picture shows", metavar="VARIABLE", of_files=True)] = None


@dataclass(frozen=True, slots=True)
class SectionQuestion:
    """At which phase, and how many strobes."""

    phase: Phase = None
    strobes: Annotated[int, Setting("most strobes", examples=(50,), low=1, high=MAX_SECTION_STROBES, metavar="N")] = (
        1000
    )


@dataclass(frozen=True, slots=True)
class BasinQuestion:
    """Which two initial values, from where to where, and how many of each."""

    x: Annotated[
        str | None, Setting("initial value across; by default the first one of the study's starts", metavar="PATH")
    ] = None
    y: Annotated[str | None, Setting("the other initial value; by default the next one", metavar="PATH")] = None
    x_from: End = None
    x_to: End = None
    y_from: End = None
    y_to: End = None
    points: Annotated[
        int,
        Setting("values of each", examples=(2,), low=2, high=MAX_BASIN_POINTS, option="--grid", metavar="N"),
    ] = 20


@dataclass(frozen=True, slots=True)
class TransientQuestion:
    """Which transient, with which load, from which angle, and how far."""

    kind: Annotated[
        str,
        Setting(
            "which transient it is", examples=("run-up",), choices=("run-up", "load-step", "coasting"), metavar="KIND"
        ),
    ]
    load: Annotated[
        str | None,
        Setting("factor on the torque of all operations during it; by default 1", examples=("1.5",), metavar="FACTOR"),
    ] = None
    angle: Annotated[
        str | None,
        Setting("angle of the shaft at which it begins, rad or with a unit; by default 0", metavar="ANGLE"),
    ] = None
    torque: Annotated[
        str | None,
        Setting("constant driving torque of a run-up, N*m or with a unit; required without a motor", metavar="TORQUE"),
    ] = None
    within: Annotated[
        str | None,
        Setting(
            "share of the first difference in speed from the steady cycle at which that counts as reached; by default "
            "0.01 with a motor, otherwise 0",
            metavar="SHARE",
        ),
    ] = None
    revolutions: Annotated[str | None, Setting("most revolutions that are computed; by default 1000", metavar="N")] = (
        None
    )
    points: Annotated[
        int,
        Setting(
            "equally spaced times",
            examples=(50,),
            low=MIN_TRAJECTORY_POINTS,
            high=MAX_TRAJECTORY_POINTS,
            metavar="N",
        ),
    ] = 1000


TRAJECTORY: Final = ViewInfo(
    "trajectory",
    TrajectoryQuestion,
    "Compute every variable, torque, power and state of one case over time, or over the angle.",
    pictures=False,
    leading=2,
)
ENGAGEMENTS: Final = ViewInfo(
    "engagements",
    EngagementsQuestion,
    "Compute every engagement of the clutches of one case, and the means of its periods.",
    pictures=False,
)
STROBES: Final = ViewInfo(
    "strobes",
    StrobesQuestion,
    "Compute the state of one case at the end of each excitation period, and its orbit.",
)
BRANCH: Final = ViewInfo(
    "branch",
    BranchQuestion,
    "Follow the periodic motion of one case along a parameter: stable and unstable orbits, folds, doublings, grazings.",
    leading=3,
)
DIAGRAM: Final = ViewInfo(
    "diagram",
    DiagramQuestion,
    "Compute a bifurcation diagram: the strobes of the settled motions of one case along a parameter.",
    leading=3,
)
SECTION: Final = ViewInfo(
    "section",
    SectionQuestion,
    "Compute a Poincare section: the strobes of the settled motion of one case at a phase of the excitation.",
    leading=2,
)
BASIN: Final = ViewInfo(
    "basin",
    BasinQuestion,
    "Compute a basin: the regime to which one case comes from each start of a grid of two initial values.",
    starts=False,
    leading=2,
)
TRANSIENT: Final = ViewInfo(
    "transient",
    TransientQuestion,
    "Compute the run-up from rest of a machine shaft, a step of its load, or its coasting, over time.",
    starts=False,
    leading=1,
)
#: Every view of a case, in the order of the API.
CASE_VIEWS: Final = (TRAJECTORY, ENGAGEMENTS, STROBES, BRANCH, DIAGRAM, SECTION, BASIN, TRANSIENT)
