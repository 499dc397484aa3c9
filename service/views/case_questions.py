"""What each view of a case is asked. Loading this module loads no engine: the commands read their options from here."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

from sprag_study.service.languages import N_
from sprag_study.service.views.setting import Setting, ViewInfo
from sprag_study.worker.limits import (
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
        label=N_("Parameter"),
    ),
]
Low = Annotated[
    str | None,
    Setting(
        "start of the range, SI or with a unit; by default the smallest on its axis", alias="from", label=N_("From")
    ),
]
High = Annotated[
    str | None, Setting("end of the range; by default the largest on its axis", alias="to", label=N_("To"))
]
Phase = Annotated[
    str | None,
    Setting(
        "phase of the excitation at the strobes, rad or with a unit; by default 0",
        examples=("90 deg",),
        metavar="ANGLE",
        label=N_("Phase"),
    ),
]
_END: Final = "SI or with a unit; by default as in the study's starts"
Begin = Annotated[str | None, Setting(_END, longest=80, label=N_("From"))]
End = Annotated[str | None, Setting(_END, longest=80, label=N_("To"))]


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
            label=N_("From"),
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
            label=N_("To"),
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
            "the table of a CSV file; JSON has both",
            choices=("engagements", "periods"),
            metavar="TABLE",
            of_files=True,
            words=(N_("engagements"), N_("periods")),
        ),
    ] = "engagements"


@dataclass(frozen=True, slots=True)
class DutyQuestion:
    """With which exponent of the Wöhler curve, and which table."""

    exponent: Annotated[
        str | None,
        Setting(
            "exponent of the Wöhler curve of all clutches, for the equivalent torque; by default that of the machine",
            examples=("5",),
            metavar="NUMBER",
            label=N_("Exponent of the Wöhler curve"),
        ),
    ] = None
    table: Annotated[
        str,
        Setting(
            "the table of a CSV file; JSON has both",
            choices=("clutches", "cycles"),
            metavar="TABLE",
            of_files=True,
            words=(N_("clutches"), N_("cycles")),
        ),
    ] = "clutches"


@dataclass(frozen=True, slots=True)
class ForcesQuestion:
    """What is known of the shaft and of its bearings, and at how many times."""

    shaft_mass: Annotated[
        str | None,
        Setting(
            "mass of the shaft and of what is fixed to it, kg or with a unit; by default that of the machine",
            examples=("1.5 kg",),
            metavar="MASS",
            label=N_("Mass of the shaft"),
        ),
    ] = None
    load_rating: Annotated[
        str | None,
        Setting(
            "basic dynamic load rating C of the bearing, N or with a unit; by default that of the machine",
            examples=("12 kN",),
            metavar="FORCE",
            label=N_("Load rating of the bearing"),
        ),
    ] = None
    bearing: Annotated[
        str | None,
        Setting(
            "kind of the bearing, for the exponent of its life; by default the exponent of the machine",
            choices=("ball", "roller"),
            metavar="KIND",
            label=N_("Bearing"),
            words=(N_("ball bearing"), N_("roller bearing")),
        ),
    ] = None
    share: Annotated[
        str | None,
        Setting(
            "part of the load that the bearing with the largest load carries; by default that of the machine",
            examples=("0.5",),
            metavar="SHARE",
            label=N_("Its share of the load"),
        ),
    ] = None
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
    table: Annotated[
        str,
        Setting(
            "the table of a CSV file; JSON has both",
            choices=("results", "forces"),
            metavar="TABLE",
            of_files=True,
            words=(N_("results"), N_("forces over time")),
        ),
    ] = "results"


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
            words=(N_("strobes"), N_("orbit")),
        ),
    ] = "strobes"


@dataclass(frozen=True, slots=True)
class BranchQuestion:
    """Along which parameter, how far, and the result of a picture."""

    along: Along
    low: Low = None
    high: High = None
    y: Annotated[
        str | None, Setting("the result that a picture shows", metavar="RESULT", of_files=True, label=N_("Result"))
    ] = None


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
            label=N_("Values"),
        ),
    ] = 200
    strobes: Annotated[
        int,
        Setting(
            "most strobes of each motion",
            examples=(16,),
            low=1,
            high=MAX_DIAGRAM_STROBES,
            metavar="N",
            label=N_("Strobes of each"),
        ),
    ] = 64
    y: Annotated[
        str | None,
        Setting("the variable that a picture shows", metavar="VARIABLE", of_files=True, label=N_("Variable")),
    ] = None


@dataclass(frozen=True, slots=True)
class SectionQuestion:
    """At which phase, and how many strobes."""

    phase: Phase = None
    strobes: Annotated[
        int, Setting("most strobes", examples=(50,), low=1, high=MAX_SECTION_STROBES, metavar="N", label=N_("Strobes"))
    ] = 1000


@dataclass(frozen=True, slots=True)
class BasinQuestion:
    """Which two initial values, from where to where, and how many of each."""

    x: Annotated[
        str | None,
        Setting(
            "initial value across; by default the first one of the study's starts", metavar="PATH", label=N_("Across")
        ),
    ] = None
    x_from: Begin = None
    x_to: End = None
    y: Annotated[
        str | None, Setting("the other initial value; by default the next one", metavar="PATH", label=N_("Up"))
    ] = None
    y_from: Begin = None
    y_to: End = None
    points: Annotated[
        int,
        Setting(
            "values of each",
            examples=(2,),
            low=2,
            high=MAX_BASIN_POINTS,
            option="--grid",
            metavar="N",
            label=N_("Points"),
        ),
    ] = 20


@dataclass(frozen=True, slots=True)
class SpeedsQuestion:
    """With which load."""

    load: Annotated[
        str | None,
        Setting(
            "factor on the torque of all operations; by default 1",
            examples=("1.5",),
            metavar="FACTOR",
            label=N_("Factor on the load"),
        ),
    ] = None


@dataclass(frozen=True, slots=True)
class TransientQuestion:
    """Which transient, with which load, from which angle, and how far."""

    kind: Annotated[
        str,
        Setting(
            "which transient it is",
            examples=("run-up",),
            choices=("run-up", "load-step", "coasting"),
            metavar="KIND",
            label=N_("Kind"),
            words=(N_("run-up from rest"), N_("step of the load"), N_("coasting, drive off")),
        ),
    ]
    load: Annotated[
        str | None,
        Setting(
            "factor on the torque of all operations during it; by default 1",
            examples=("1.5",),
            metavar="FACTOR",
            label=N_("Factor on the load"),
        ),
    ] = None
    angle: Annotated[
        str | None,
        Setting(
            "angle of the shaft at which it begins, rad or with a unit; by default 0",
            metavar="ANGLE",
            label=N_("Angle at the start"),
        ),
    ] = None
    torque: Annotated[
        str | None,
        Setting(
            "constant driving torque of a run-up, N*m or with a unit; required without a motor",
            metavar="TORQUE",
            label=N_("Driving torque of a run-up"),
        ),
    ] = None
    within: Annotated[
        str | None,
        Setting(
            "share of the first difference in speed from the steady cycle at which that counts as reached; by default "
            "0.01 with a motor, otherwise 0",
            metavar="SHARE",
            label=N_("Counts as reached at"),
        ),
    ] = None
    revolutions: Annotated[
        str | None,
        Setting("most revolutions that are computed; by default 1000", metavar="N", label=N_("Most revolutions")),
    ] = None
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


@dataclass(frozen=True, slots=True)
class StartUpQuestion:
    """Which ramps, and what counts as settled."""

    ramp: Annotated[
        str | None,
        Setting(
            "time in which the excitation frequency rises linearly to its value, in s or with a unit (s, periods of "
            "the final frequency); by default 0",
            examples=("0.5 s",),
            metavar="TIME",
            label=N_("Ramp of the frequency"),
        ),
    ] = None
    start_frequency: Annotated[
        str | None,
        Setting(
            "frequency at which that ramp begins, Hz or with a unit; by default 0",
            examples=("5 Hz",),
            metavar="FREQUENCY",
            label=N_("Frequency at the start"),
        ),
    ] = None
    load_ramp: Annotated[
        str | None,
        Setting(
            "time in which the load of the shaft rises linearly from nothing, with the same units; by default 0",
            metavar="TIME",
            label=N_("Ramp of the load"),
        ),
    ] = None
    within: Annotated[
        str | None,
        Setting(
            "share by which a mean speed may differ from the settled one; by default 0.02",
            examples=("5 %",),
            metavar="SHARE",
            label=N_("Counts as settled within"),
        ),
    ] = None
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
    leading=2,
    title=N_("Motion"),
)
ENGAGEMENTS: Final = ViewInfo(
    "engagements",
    EngagementsQuestion,
    "Compute every engagement of the clutches of one case, and the means of its periods.",
    pictures=False,
    title=N_("When the clutches engage"),
)
DUTY: Final = ViewInfo(
    "duty",
    DutyQuestion,
    "Compute what the clutches of one case have to bear: cycles of torque, impacts, overrunning, slip.",
    pictures=False,
    title=N_("What the clutches have to bear"),
)
FORCES: Final = ViewInfo(
    "forces",
    ForcesQuestion,
    "Compute the forces of one case on the vibrating table and on the bearings of its shaft, and their rating life.",
    title=N_("Forces on the table and on the bearings"),
    note=N_(
        "Force of the pendulums and of the shaft on the vibrating table, over one turn of the settled motion or over "
        "the window. An exciter gives the opposite force, and what accelerates the table. The bearings of the shaft "
        "carry the same load where the pendulums hang on the shaft and their springs act in pairs; belts and gears "
        "are not in it."
    ),
)
STROBES: Final = ViewInfo(
    "strobes",
    StrobesQuestion,
    "Compute the state of one case at the end of each excitation period, and its orbit.",
    title=N_("How it settles, period by period"),
    note=N_(
        "The state at the end of each excitation period: angle and speed of each pendulum, and period by period. "
        "Points that approach one place, or a few, show a motion that settles; the line is one whole turn of the "
        "settled motion."
    ),
)
BRANCH: Final = ViewInfo(
    "branch",
    BranchQuestion,
    "Follow the periodic motion of one case along a parameter: stable and unstable orbits, folds, doublings, grazings.",
    leading=3,
    title=N_("Along a parameter: where this motion is stable, and where it ends"),
    note=N_(
        "Full lines are stable motions, dashed ones unstable. Open marks are special points: at a fold the branch "
        "turns back, at a doubling a motion of twice the period begins, at a grazing an event of a clutch or of the "
        "shaft appears or disappears. The points are the study's own cases; another motion than this one is off the "
        "branch."
    ),
)
DIAGRAM: Final = ViewInfo(
    "diagram",
    DiagramQuestion,
    "Compute a bifurcation diagram: the strobes of the settled motions of one case along a parameter.",
    leading=3,
    title=N_("Along a parameter: to what it settles (bifurcation diagram)"),
    note=N_(
        "At each value of the parameter this case settles from its own start, and its state is taken once in each "
        "excitation period, at the chosen phase: one point for a motion that repeats in every period, two where its "
        "period has doubled, many for irregular motion."
    ),
)
SECTION: Final = ViewInfo(
    "section",
    SectionQuestion,
    "Compute a Poincare section: the strobes of the settled motion of one case at a phase of the excitation.",
    leading=2,
    title=N_("Once in each period: regular or irregular (Poincaré section)"),
    note=N_(
        "Angle and speed of each pendulum of this case once in each excitation period, at the chosen phase, after it "
        "has settled: a few points are a periodic motion, a closed line a quasi-periodic one, a cloud an irregular "
        "one."
    ),
)
BASIN: Final = ViewInfo(
    "basin",
    BasinQuestion,
    "Compute a basin: the regime to which one case comes from each start of a grid of two initial values.",
    starts=False,
    leading=2,
    title=N_("From other starts: to which motion it comes (basin)"),
    note=N_(
        "Each point is a start of this case, in the colour of the regime to which it comes: its number, its share of "
        "these starts, its mean speed and its order. The case is run from every start for this."
    ),
)
START_UP: Final = ViewInfo(
    "startup",
    StartUpQuestion,
    "Compute the start-up of one case with ramps of the excitation frequency and of the load: time, energy, torques.",
    title=N_("Start-up: how long until the shaft runs at its settled speed"),
    note=N_(
        "From the start of this case, while the excitation frequency and the load rise to their values. The dashed "
        "line is the mean speed of the motion to which the drive comes."
    ),
)
SPEEDS: Final = ViewInfo(
    "speeds",
    SpeedsQuestion,
    "Compute every steady cycle of a machine shaft: its speed, its multiplier, and from which speeds the shaft comes "
    "to it.",
    starts=False,
    title=N_("All steady speeds, and to which the shaft comes"),
    note=N_(
        "By how much the shaft is faster a cycle later, over its speed at the angle 0. It turns steadily where the "
        "line crosses zero: falling, in a stable cycle; rising, in an unstable one, from which the shaft goes to one "
        "of its neighbours, or stops or runs away."
    ),
)
TRANSIENT: Final = ViewInfo(
    "transient",
    TransientQuestion,
    "Compute the run-up from rest of a machine shaft, a step of its load, or its coasting, over time.",
    starts=False,
    leading=1,
    title=N_("Run-up, load step, coasting"),
    note=N_(
        "Speed, torques of drive and resistance on the main shaft, and kinetic energy. The dashed and the dotted line "
        "are the mean speeds of the steady cycles before and after."
    ),
)
#: Every view of a case, in the order of the API.
CASE_VIEWS: Final = (
    TRAJECTORY, ENGAGEMENTS, DUTY, FORCES, STROBES, BRANCH, DIAGRAM, SECTION, BASIN, START_UP, SPEEDS, TRANSIENT,
)  # fmt: skip
