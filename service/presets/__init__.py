"""Studies that come with the program: demonstrations and starting points."""

from dataclasses import dataclass
from importlib.resources import files
from typing import Final

_FORMATS = (".json", ".toml")


@dataclass(frozen=True, slots=True)
class About:
    """Description of a preset: its number of cases, ``shows``, what it demonstrates, and ``values``, the source of its
    numbers.

    The cases are told here because to count them takes numba and scipy, which the service's own process does not load.
    """

    cases: int
    shows: str
    values: str


#: Descriptions of the presets. The files of machine shafts begin with further comments.
ABOUT: Final[dict[str, About]] = {
    "one_pendulum": About(
        512,
        "the mechanical characteristic of a drive with one pendulum: speed, torque, power and efficiency against load, "
        "at several frequencies and amplitudes",
        "a hand-sized rig: 0.5 kg at 30 mm on springs that give it a natural frequency of 24 Hz, near the 25 Hz of a "
        "four-pole unbalance motor on 50 Hz mains",
    ),
    "two_pendulums": About(
        96,
        "two pendulums of different stiffness on one shaft: one clutch drives while the other overruns",
        "the rig of one_pendulum with a second, stiffer pendulum and clutches with a backlash of 0.3 degrees",
    ),
    "refined_characteristic": About(
        34,
        "speed and efficiency against load at two frequencies, in rounds that add loads until lines between the points "
        "are accurate to within 1 %",
        "the rig of one_pendulum",
    ),
    "tolerances": About(
        1028,
        "256 drives with tolerances at four loads: ribbon of their speeds, yield, and the tolerance that matters",
        "the rig of one_pendulum with typical tolerances",
    ),
    "two_motions": About(
        26,
        "two motions at one load: up and down differ where the frequency rises and falls between 16.1 and 16.6 Hz",
        "the rig of one_pendulum with a load of 0.4 N*m",
    ),
    "press": About(
        52,
        "a crank press whose irregularity falls with the flywheel; too little inertia at low speed is an ending of its "
        "own",
        "a light press of 200 mm of stroke with 20 kN over the last 60 degrees",
    ),
    "punching_press": About(
        39,
        "a rim flywheel behind a belt and a gear: the rim that an irregularity needs, its stress, and the motor",
        "a press of 40 mm of stroke at 40 strokes a minute that punches with 250 kN over the last 30 degrees",
    ),
    "six_bar_press": About(
        32,
        "a linkage of one's own, a list of pivots and groups of two links: irregularity against its rocker and the "
        "flywheel",
        "a bench press of about 0.1 m of stroke that stamps thin sheet with 4 kN over the last quarter",
    ),
    "shaper": About(
        36,
        "a crank-shaper quick return under a cutting force over the slow stroke",
        "a shaper of about 0.4 m of stroke at 40 strokes a minute, 3 kN for a cut of 1.5 mm^2 in steel",
    ),
    "slotter": About(
        28,
        "a Whitworth quick return with a vertical ram, turned by an induction motor: the speed is a result",
        "a slotter of about 0.3 m of stroke at 30 strokes a minute with a motor of about 1 kW",
    ),
    "compressor": About(
        36,
        "the gas itself as resistance: flywheel and irregularity against discharge pressure",
        "a workshop compressor of 100 mm bore and 80 mm stroke at 750 rpm",
    ),
    "two_cylinder_compressor": About(
        25,
        "two mechanisms on one shaft: irregularity against the angle between their cranks",
        "two cylinders of the workshop compressor",
    ),
    "four_cylinder_engine": About(
        30,
        "four mechanisms with the firing order 1-3-4-2, two revolutions a cycle: irregularity against the flywheel",
        "a petrol engine of 80 mm bore and stroke with a compression ratio of 9 and 50 bar",
    ),
    "conveyor": About(
        52,
        "irregularity caused by masses more than by work: a tray that rocks back and forth",
        "an oscillating conveyor of 30 mm of stroke at 300 strokes a minute with 150 kg",
    ),
    "cam_machine": About(
        33,
        "a cam that lifts a tool against a spring: work that flows back and forth",
        "a packaging machine of 120 strokes a minute with 40 mm of lift",
    ),
    "question_drive_inertia": About(76, "irregularity against the inertia of the drive", "the crank press"),
    "question_masses": About(68, "irregularity against masses and geometry of the actuator", "the crank press"),
    "question_operation": About(68, "irregularity against the diagram of the operation", "the crank press"),
    "fastest_drive": About(
        40,
        "a search for one goal: the fastest drive against 0.3 N*m whose clutch torques stay below 3 N*m",
        "the rig of one_pendulum",
    ),
    "least_flywheel": About(
        32,
        "a search with a limit that binds: the least flywheel that keeps the irregularity below 0.1 at two speeds",
        "the crank press",
    ),
}


def _files() -> dict[str, str]:
    return {
        item.name.rpartition(".")[0]: item.name for item in files(__name__).iterdir() if item.name.endswith(_FORMATS)
    }


def preset_names() -> tuple[str, ...]:
    """Names of the presets in the recommended order."""
    return tuple(name for name in ABOUT if name in _files())


def preset_text(name: str) -> tuple[str, str]:
    """File name and text of a preset's spec; KeyError for an unknown name."""
    file = _files()[name]
    return file, (files(__name__) / file).read_text(encoding="utf-8")
