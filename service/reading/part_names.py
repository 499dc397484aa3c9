"""What parts of a machine, parts of a spec and settings of a run are called."""

from __future__ import annotations

from typing import Final

from sprag_study.service.languages import N_, _, gettext
from sprag_study.service.reading.wording import words
from sprag_study.worker import models
from sprag_study.worker.models.common import LOADS
from sprag_study.worker.models.vocabulary import ordinal

#: What parts of a machine are called that have a number.
NUMBERED: Final = {
    "pendulums": N_("Pendulum {number}"), "parts": N_("Part {number}"), "stages": N_("Stage {number}"),
    "steps": N_("Step {number}"), "elements": N_("Element {number}"), "axes": N_("Axis {number}"),
    "values": N_("Value {number}"), "tolerances": N_("Tolerance {number}"), "subject_to": N_("Constraint {number}"),
}  # fmt: skip
#: Parts of a spec beside those of a machine.
PARTS: Final = (
    N_("Columns"), N_("Count"), N_("Csv"), N_("Data"), N_("Diagram"), N_("Drives"), N_("Goal"), N_("Limits"),
    N_("Points"), N_("Price"), N_("Rows"), N_("Run"), N_("Sense"), N_("Starts"), N_("Table"), N_("Tolerances"),
    N_("Torque"), N_("Values"),
)  # fmt: skip
#: Labels of settings of the run that have a field in the form.
RUN_LABELS: Final = {
    "until": N_("Each case runs"), "at_most": N_("At most"), "settled": N_("Settled within"),
    "max_period": N_("Largest order"), "duration": N_("Duration"), "tolerance": N_("Tolerance"),
    "reset": N_("Windup counts"), "loads": N_("Forces and duty"),
}  # fmt: skip
#: The label of `loads` of a model with other ones.
LOADS_OF_SHAFTS: Final = N_("Loads")


def part_name(path: str) -> str:
    """What a part of a machine, or of a spec, is called: ``Pendulum 1, clutch``."""
    if not path:
        return _("General")
    names: list[str] = []
    for name in path.split("."):
        if name.isdigit():
            text = NUMBERED.get(names.pop(), N_("No. {number}"))
            names.append(_(text, number=ordinal(name)))
        else:
            names.append(name)
    said = [gettext(words(name)) if name.islower() else name for name in names]
    return ", ".join([said[0], *map(lower_first, said[1:])])


def run_name(model: str, name: str) -> str:
    """What a setting of the run of a model is called: ``Largest order``."""
    if (model, name) == (models.MACHINE_SHAFT, LOADS):
        return _(LOADS_OF_SHAFTS)
    if name == "window":
        return _("evaluated window")
    return _(RUN_LABELS[name] if name in RUN_LABELS else words(name))


def lower_first(text: str) -> str:
    """A caption within a sentence; one that begins with an abbreviation stays as it is."""
    return text if text[1:2].isupper() else f"{text[:1].lower()}{text[1:]}"


def upper_first(text: str) -> str:
    """A text as the beginning of a sentence."""
    return f"{text[:1].upper()}{text[1:]}"
