"""The form of machine shafts."""

from __future__ import annotations

from typing import Final

from sprag_study.engine.machine_shaft.spec import MAX_PARTS, MAX_STAGES, REVOLUTIONS
from sprag_study.worker.models.form import Block, ComponentKind, Form, FormChoice, FormField, Hidden, Option, Rows

_FORMULA_HELP: Final = "of phi in rad, such as 40*sin(2*phi)^2; of an operation also of t in s, x and omega"
_TABLE_HELP: Final = "two columns, with units in their headings"
#: What a motor of any kind may have.
_OF_ANY_MOTOR: Final = ("inertia", "rated_torque")
#: Motors and the numbers of each.
MOTORS: Final = {
    "linear": ("a motor with a linear characteristic", ("no_load_speed", "stall_torque", "inertia", "rated_torque")),
    "kloss": (
        "an induction motor (Kloss)",
        ("inertia", "synchronous_speed", "breakdown_torque", "breakdown_slip", "rated_torque"),
    ),
    "table": ("a motor with a measured characteristic", ("inertia", "scale", "rated_torque")),
}
_COMPONENT_MOTORS: Final = {
    kind: tuple(name for name in MOTORS[kind][1] if name not in _OF_ANY_MOTOR) for kind in ("kloss", "linear")
}
_GEARED: Final = ("ratio", "efficiency", "output_inertia", "inertia")
_STAGES: Final = {
    **dict.fromkeys(("gear", "worm"), _GEARED), **dict.fromkeys(("belt", "chain"), (*_GEARED, "mass", "radius")),
    "screw_nut": ("lead", "inertia", "mass"), "rack": ("radius", "inertia", "mass"),
    "coupling": ("stiffness", "relative_damping", "inertia", "output_inertia"),
}  # fmt: skip
#: Mechanisms and their choices.
_BODIES: Final = ("weights", "bodies")
_MECHANISMS: Final = {
    "slider_crank": _BODIES, "four_bar": _BODIES, "drag_link": _BODIES, "toggle": _BODIES, "scotch_yoke": (),
    "parallel_crank": (), "quick_return": ("kind", *_BODIES), "cam": ("rise", "fall"),
}  # fmt: skip


def _formula(at: str) -> FormField:
    example = "40*sin(2*phi)^2"
    return FormField(f"{at}/formula", "text", "Formula", _FORMULA_HELP, example=example, required=True, lines=2)


def _table(at: str, headings: str, *columns: str) -> tuple[FormField, ...]:
    rows = f"{headings}\n0,0\n180,20\n360,0"
    table = FormField(f"{at}/csv", "table", "Table", _TABLE_HELP, example=rows, required=True, lines=5, columns=columns)
    return table, FormField(f"{at}/interpolation")


def _mechanism(kind: str) -> Option:
    at = f"mechanism/{kind}"
    hidden = [Hidden(f"{at}/bodies", ("two_mass",), ("rod_inertia", "coupler_inertia"))]
    if kind == "four_bar":
        hidden.append(Hidden(f"{at}/weights", ("ram",), ("inclination",)))
    choices = (FormField(f"{at}/{name}") for name in _MECHANISMS[kind])
    return Option(kind, "", (*choices, FormField(f"{at}/*", hidden=tuple(hidden))), at=at)


_LINKAGE_HELP: Final = (
    "one a line, each after those to which it is attached: kind and name; its fields with = between semicolons"
)
_LINKAGE: Final = Option(
    "linkage", "", (
        FormField("mechanism/linkage/crank"),
        FormField(
            "mechanism/linkage/elements", "elements", "Elements", _LINKAGE_HELP, required=True, lines=5,
            example="pivot B; x = 220 mm\nRRR C; from = A; to = B; first = 200 mm; second = 130 mm",
        ),
        FormField(
            "mechanism/linkage/working", "text", "Working part", "joint of the ram or of the rocker's pin",
            default="none", example="C",
        ),
        FormField("mechanism/linkage/forward"),
        FormField("mechanism/linkage/inclination"),
    ), at="mechanism/linkage",
)  # fmt: skip


def _balance(kind: str) -> dict[str, str]:
    return {"balance": kind, "balance_side": "drive"}


def _motor(kind: str) -> Option:
    label, numbers = MOTORS[kind]
    table = _table("drive/motor", "speed [rpm],torque [N*m]", "speed", "torque") if kind == "table" else ()
    return Option(
        kind,
        label,
        (*table, *_fields("drive/motor", *numbers)),
        at="drive/motor",
        is_kind=True,
        implies=_balance("motor"),
    )


def _fields(at: str, *names: str) -> tuple[FormField, ...]:
    return tuple(FormField(f"{at}/{name}") for name in names)


_BALANCE: Final = (FormField("balance", default="by default", without=("motor",)), FormField("balance_side"))
_SCALED: Final = (*_fields("drive", "scale"), *_BALANCE)
_TORQUE: Final = "drive/torque"
_DRIVE: Final = FormChoice(
    "drive", "Driving torque", help="or the motor that gives it",
    options=(
        Option("found", "the constant torque that balances the operation", implies=_balance("constant")),
        Option("value", "a constant torque", (FormField(_TORQUE), *_BALANCE), at=_TORQUE),
        Option("formula", "a formula of the angle", (_formula(_TORQUE), *_SCALED), at=f"{_TORQUE}/formula"),
        Option("csv", "a table over the angle",
               (*_table(_TORQUE, "angle [deg],torque [N*m]", "angle", "torque"), *_SCALED), at=f"{_TORQUE}/csv"),
        *map(_motor, MOTORS),
    ),
)  # fmt: skip
_ON_SHAFT: Final = FormField("drive/flywheel/shaft", label="Shaft", default="main shaft", example="0")
_MATERIAL: Final = ("density", "poisson_ratio", "allowed_stress")
_FLYWHEELS: Final = {
    "rim": ("", ("mass",)), "disc": ("", ("mass",)),
    "ring": ("a rim by its width and thickness", ("width", "thickness")),
}  # fmt: skip
_FLYWHEEL: Final = FormChoice(
    "drive/flywheel", "Flywheel", help="by its dimensions",
    options=(
        Option("none", "none"),
        *(Option(kind, label, (*_fields("drive/flywheel", "diameter", *size, *_MATERIAL), _ON_SHAFT),
                 at="drive/flywheel", is_kind=True)
          for kind, (label, size) in _FLYWHEELS.items()),
    ),
)  # fmt: skip
_MECHANISM: Final = FormChoice(
    "mechanism", "Mechanism",
    options=(
        Option("none", "none"),
        *map(_mechanism, _MECHANISMS),
        _LINKAGE,
        Option("formula", "inertia as a formula", (_formula("mechanism"),), at="mechanism/formula"),
        Option("csv", "inertia as a table", _table("mechanism", "angle [deg],inertia [kg*m^2]", "angle", "inertia"),
               at="mechanism/csv"),
    ),
)  # fmt: skip
_OVER, _INDICATOR = "operation/over", "operation/indicator"
_COURSE: Final = (
    *_fields("operation", "quantity", "over"),
    FormField("operation/during", hidden=(Hidden(_OVER, ("angle", "time")),)),
    FormField("operation/sense"),
    FormField("operation/recorded_at", hidden=(Hidden(_OVER, ("angle", "stroke")),)),
)  # fmt: skip
_SHARE: Final = _fields("operation", "scale", "efficiency", "efficiency_is")
_STEPS: Final = FormField(
    "operation/steps", "steps", "Steps", "one step a line: from; to; value", example="120 deg; 180 deg; 20 kN",
    required=True, lines=3,
)  # fmt: skip
_OPERATION: Final = FormChoice(
    "operation", "Resistance",
    options=(
        Option("none", "none"),
        Option("value", "constant", (*_COURSE, *_fields("operation", "value"), *_SHARE), at="operation/value"),
        Option("steps", "steps", (*_COURSE, _STEPS, *_SHARE), at="operation/steps"),
        Option("formula", "formula", (*_COURSE, _formula("operation"), *_SHARE), at="operation/formula"),
        Option("csv", "table",
               (*_COURSE, *_table("operation", "angle [deg],force [kN]", f"@{_OVER}", "@operation/quantity"), *_SHARE),
               at="operation/csv"),
        Option("gas", "gas in a compressor", (FormField("operation/gas/*"), *_SHARE), at="operation/gas"),
        Option("indicator", "indicator diagram", (
            FormField(f"{_INDICATOR}/over"),
            FormField(f"{_INDICATOR}/recorded_at", hidden=(Hidden(f"{_INDICATOR}/over", ("angle", "stroke")),)),
            FormField(f"{_INDICATOR}/*"),
            *_table(_INDICATOR, "angle [deg],pressure [bar]", f"@{_INDICATOR}/over", "pressure"),
            *_SHARE,
        ), at=_INDICATOR),
    ),
)  # fmt: skip
_STAGE: Final = tuple(
    FormField(f"{name}", hidden=(Hidden("kind", tuple(kind for kind, own in _STAGES.items() if name not in own)),))
    for name in dict.fromkeys(name for own in _STAGES.values() for name in own)
)

FORM: Final = Form(
    parts=(
        Block("Machine", (
            FormField("mean_speed", hidden=(Hidden("drive", tuple(MOTORS)),)),
            FormField("mean_speed_is"),
            FormField(
                "cycle", "number", "Cycle", f"revolutions until everything repeats, 1 to {max(REVOLUTIONS)}",
                default="1 revolution", example="2 revolutions",
            ),
            *(FormField(name) for name in ("wanted_irregularity", "friction_torque", "gravity")),
            FormField("phi_c", label="Reference angle", symbol="phi_c", default="by default"),
            FormField(
                "constants", "constants", "Constants of formulas", "one a line: name = value", example="k = 40", lines=2
            ),
        )),
        Block("Drive", (FormField("drive/inertia"), _DRIVE, _FLYWHEEL), adds="stages"),
        Rows(
            "stages", "drive/stages", 0, MAX_STAGES, "Stage {number}", "Add a stage", "Remove this stage",
            blocks=(Block("", (FormField("kind"), *_STAGE)),), copies=False,
        ),
        Rows(
            "parts", "parts", 0, MAX_PARTS, "Part {number}: {label}", "Add a part", "Remove this part",
            blocks=(Block("Mechanism", (_MECHANISM,)), Block("Operation", (_OPERATION,))),
            alone=True,
            fields=(
                FormField("crank_angle"),
                FormField("ratio", label="Ratio of its shaft"),
                FormField(
                    "cycle", "number", "Cycle of the part", "revolutions of its shaft until the part repeats itself",
                    default="all in a cycle of the machine", example="1 revolution",
                ),
            ),
        ),
    ),
    components=(
        ComponentKind(
            "motor", "Motors",
            {"characteristic": "drive",
             **{name: f"drive/motor/{name}" for own in _COMPONENT_MOTORS.values() for name in own},
             **{name: f"drive/motor/{name}" for name in _OF_ANY_MOTOR}},
            required=("characteristic",),
            twice="the motor is given twice", foreign="is not a field of this motor",
            change="Add or change a motor", keep="Keep the motor",
            choice="characteristic", ways=_COMPONENT_MOTORS,
            titles={kind: MOTORS[kind][0] for kind in _COMPONENT_MOTORS},
            chosen="drive/motor/kind", replaces=("drive/motor",),
        ),
    ),
    new={"/base/mechanism": "slider_crank", "/base/operation": "steps", "/refine/results": "irregularity"},
    called="a machine shaft",
    with_loads=True,
    front=(
        "mean_speed", "wanted_irregularity", "drive", r"drive\.(inertia|torque(\.\w+)?|flywheel)",
        r"drive\.motor\.(?!inertia|rated).*", r"drive\.flywheel\.(mass|diameter|width|thickness|shaft)",
        r"drive\.stages\.N\.(kind|ratio|lead|radius|stiffness|relative_damping)",
        r"(parts\.N\.)?(mechanism|operation|crank_angle)",
        r"(parts\.N\.)?mechanism\.\w+\.(?!(kind|bodies|weights|rise|fall|inclination|.*_(centre|inertia|angle))$).*",
        r"(parts\.N\.)?mechanism\.(formula|csv|cam\.\w+_angle|linkage\.(elements|working))",
        r"(parts\.N\.)?operation\.(quantity|over|value|steps|formula|csv|scale|gas\.\w+_(area|pressure)|indicator\.csv)",
    ),
    examples={
        "values": "1; 2; 5 kg*m^2", "from": "200 rpm", "to": "400 rpm", "value": "300 rpm",
        "tied": "parts.1.mechanism.slider_crank.crank",
        "columns": "operation.scale\tdrive.inertia [kg*m^2]\n1\t0.2\n1.5\t0.3",
        "points": "operation.scale,drive.inertia [kg*cm^2]\n1,200\n1.5,300",
    },
    groups=(
        ("drive.flywheel.", "Flywheel"), ("drive.motor.", "Motor"), ("drive.stages.", "Stages"), ("drive.", "Drive"),
        ("mechanism.", "Mechanism"), ("operation.", "Operation"), ("constants.", "Constants"), ("", "Machine"),
    ),
)  # fmt: skip
