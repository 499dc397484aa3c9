"""The form of vibration drives."""

from __future__ import annotations

from typing import Final

from sprag_study.engine.vibration_drive.parameters import (
    MAX_COEFFICIENTS,
    MAX_HARMONICS,
    MAX_LOAD_ROWS,
    MAX_PENDULUMS,
)
from sprag_study.worker.models.form import Block, ComponentKind, Form, FormChoice, FormField, Option, Rows

_CLUTCH: Final = FormChoice(
    "clutch/kind", "How the clutch is given", control="switch",
    options=(
        Option("law", "Coefficients", (
            FormField(
                "clutch/coefficients", "list", "Coefficients",
                f"c₁; c₂; c₃; … of the torque c₁ + c₂u + c₃u² + … over the windup u, in N·m/rad^(k−1); 1 to "
                f"{MAX_COEFFICIENTS}",
                example="0; 200; 0; 20000", required=True,
            ),
            FormField(
                "clutch/windup_limit", "number", "Windup limit",
                "largest windup to which the law was measured; beyond it the law continues straight", range="> 0 rad",
                default="none", example="0.05 rad", symbol="u_end", unit="rad",
            ),
        )),
        Option("data", "Measured data", (
            FormField(
                "clutch/data", "measured", "Measured angle and torque",
                "two columns, pasted from a spreadsheet; a header such as angle_deg, torque_Nm names the units, "
                "without one they are rad and N·m",
                example="angle_deg\ttorque_Nm\n0\t0\n0.25\t0.878", required=True, lines=7,
            ),
            FormField(
                "clutch/accuracy", "number", "Accuracy", "largest residual of the fit that is accepted",
                range="> 0 N*m", example="0.05 N*m", unit="N*m", required=True,
            ),
            FormField("clutch/max_degree"),
            FormField("clutch/through_origin", "tick", "No torque at zero windup", default="on"),
            FormField("clutch/angles_include_backlash", "tick", "Angles include the backlash"),
        ), at="clutch/data"),
    ),
)  # fmt: skip
_WHOSE: Final = FormChoice(
    "clutches", "Whose clutch", control="radio", several="pendulums",
    options=(
        Option("common", "One law for all pendulums", (_CLUTCH,)),
        Option("own", "One law for each pendulum", at="pendulums/0/clutch"),
    ),
)  # fmt: skip

#: What the maker of a clutch says of it.
_RATINGS: Final = ("rated_torque", "rated_frequency", "rated_speed", "fatigue_exponent")

#: How a pendulum and its clutch start.
_START: Final = ("initial_angle", "initial_speed", "initial_windup", "initial_clutch")
#: Loads of the shaft beside the constant one, and what its bearings are asked about.
_LOADS: Final = (
    "linear_load", "quadratic_load", "stribeck_load", "stribeck_speed", "cyclic_load", "load_cycles", "load_phase",
)  # fmt: skip
_FACTOR: Final = FormField("shaft/load_factor")
_BEARINGS: Final = ("bearing_damping", "bearing_rating", "bearing_exponent", "bearing_share", "rotor_mass")

#: A load that is given as a table.
_LOAD: Final = FormField(
    "shaft/load_table/csv", "table", "Load as a table over the speed",
    f"two columns with headings and units, pasted from a spreadsheet; 2 to {MAX_LOAD_ROWS} rows with ascending speeds, "
    "straight lines between them; the load at the ends holds beyond them",
    example="speed [rpm],torque [N*m]\n0,0.05\n200,0.2", lines=5, columns=("speed", "torque"),
)  # fmt: skip

#: Harmonics of the base vibration.
_HARMONICS: Final = FormField(
    "excitation/harmonics/csv", "table", "Harmonics of the vibration",
    "five columns with headings and units, pasted from a spreadsheet: order, amplitude and phase along x, amplitude "
    f"and phase along y; at most {MAX_HARMONICS} rows, beside the amplitudes above, which are those of order 1",
    example="order,x [mm],phase x [deg],y [mm],phase y [deg]\n2,0.2,0,0.3,90\n3,0,0,0.1,45", lines=4,
    columns=("order", "amplitude_x", "phase_x", "amplitude_y", "phase_y"),
)  # fmt: skip

#: What the base does beside the vibration of one frequency.
_FURTHER: Final = FormChoice(
    "excitation/further", "Further motion of the base", control="switch",
    options=(
        Option("harmonics", "Harmonics", (_HARMONICS,)),
        Option("measured", "One measured period", (
            FormField(
                "excitation/measured/csv", "table", "Measured motion",
                "angle or time, then x, y or both, as displacements or accelerations, pasted from a spreadsheet with "
                "headings and units; rows over one period, which are reduced to harmonics; leave the amplitudes above "
                "empty, as they are added",
                example="angle [deg],x [mm],y [mm]\n0,0.5,0\n5,0.49,0.02", required=True, lines=7,
                columns=("angle|time", "displacement_x|acceleration_x", "displacement_y|acceleration_y"),
            ),
            FormField(
                "excitation/measured/period", "number", "Period of the measurement",
                "of rows with times or accelerations only", range="> 0 s", example="40 ms", unit="s",
            ),
            FormField(
                "excitation/measured/accuracy", "number", "Accuracy of the reduction",
                "rms residual at which the reduction to harmonics ends, as a share of the amplitude",
                range="> 0, <= 1", default="1 %", example="1 %", unit="1",
            ),
        ), at="excitation/measured/csv"),
    ),
)  # fmt: skip

FORM: Final = Form(
    parts=(
        Block("Vibration of the base", (FormField("excitation/*"),)),
        Block("Further motion of the base", (_FURTHER, FormField("excitation/harmonic_factor")), within=True),
        Rows(
            "pendulums", "pendulums", 1, MAX_PENDULUMS, "Pendulum {number}", "Add a pendulum", "Remove the last one",
            blocks=(
                Block("", (FormField("*"),)),
                Block("Its clutch", (_CLUTCH,), within=True, only=("clutches", "own")),
                Block(
                    "Losses and ratings of its freewheel",
                    tuple(map(FormField, ("clutch_damping", "overrunning_damping", *_RATINGS))), within=True,
                ),
                Block("Its motion at the start", tuple(map(FormField, _START)), within=True),
            ),
            only_last=True, shared=("clutches", "clutch"), every="every pendulum", one="pendulum {number}",
        ),
        Block("Freewheel clutch", (_WHOSE,)),
        Block("Output shaft", (FormField("shaft/*"),)),
        Block(
            "Load that depends on speed or angle", (*(FormField(f"shaft/{name}") for name in _LOADS), _LOAD, _FACTOR),
            within=True,
        ),
        Block("Bearings", tuple(FormField(f"shaft/{name}") for name in _BEARINGS), within=True),
        Block("Surroundings", (FormField("*"),)),
    ),
    components=(
        ComponentKind(
            "spring", "Springs", {name: f"pendulums/N/{name}" for name in ("spring_rate", "damping")},
            required=("spring_rate",),
            twice="the spring is given twice", foreign="is not a field of this spring",
            change="Add or change a spring", keep="Keep the spring",
        ),
        ComponentKind(
            "clutch", "Clutches",
            {
                "coefficients": "clutch/coefficients", "windup_limit": "clutch/windup_limit",
                "backlash": "pendulums/N/backlash",
                **{name: f"pendulums/N/{name}" for name in _RATINGS},
            },
            required=("coefficients",),
            twice="the clutch is given twice", foreign="is not a field of this clutch",
            change="Add or change a clutch", keep="Keep the clutch",
            # Those of another clutch are not its ratings.
            sets={
                "clutch/kind": "law", "clutch/windup_limit": "", **{f"pendulums/N/{name}": "" for name in _RATINGS},
            },
            replaces=("clutch",),
        ),
    ),
    called="a vibration drive",
    with_run=True,
    drawer="Clutch, damping, phase, run, further cases",
    front=(
        r"excitation\.(frequency|amplitude_[xy])",
        r"pendulums\.N\.(mass|arm|inertia|spring_rate|spring_arm|backlash)", r"shaft\.(inertia|load)",
    ),
    examples={
        "values": "0; 0.1; 0.2 N*m", "from": "20 Hz", "to": "35 Hz", "value": "0.2 N*m",
        "tied": "excitation.amplitude_y",
        "columns": "shaft.load [N*mm]\texcitation.frequency [Hz]\n100\t25\n200\t30",
        "points": "shaft.load [N*mm],excitation.frequency [Hz]\n100,25\n200,30",
    },
    normal="Normal: ± is three standard deviations, so that nearly all drives are within it. Each place of the study "
    "is run with the nominal drive and with the drawn ones.",
    advice="Start the load at 0: the main curve then begins at the no-load speed.",
    labels={"clutch.coefficients.K": "{part} coefficient c{number}"},
)  # fmt: skip
