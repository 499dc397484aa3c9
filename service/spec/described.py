"""Fields of a spec that are not model parameters, each described once for reader, JSON Schema and form."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, Literal

from sprag.worker.limits import (
    MAX_ORBIT_PERIODS,
    MAX_SETTLED,
    MAX_SETTLED_PERIODS,
    MAX_TOLERANCE,
    MIN_SETTLED,
    MIN_SETTLED_PERIODS,
    MIN_TOLERANCE,
)
from sprag.worker.models import MAX_COEFFICIENTS, SETTLED


@dataclass(frozen=True, slots=True)
class Described:
    """One field.

    Attributes
    ----------
    name, label, help : its name, its label in the form, and its meaning
    kind : "whole" and "number", from ``low`` to ``high``; "periods", a text with a whole number of periods; "time", a
        number of seconds or a text; "flag"; "choice", one of ``choices``: values and their labels in the form
    default : value of a field that is not given
    """

    name: str
    label: str
    help: str
    kind: Literal["whole", "number", "periods", "time", "flag", "choice"]
    low: float = 0
    high: float = 0
    default: Any = None
    choices: tuple[tuple[str, str], ...] = ()

    @property
    def default_text(self) -> str:
        """The default as a user would write it."""
        text = f"{self.default:g}".replace("e-0", "e-") if isinstance(self.default, float) else str(self.default)
        return f"{text} periods" if self.kind == "periods" else text

    def schema(self) -> dict[str, Any]:
        """Its JSON Schema."""
        told: dict[str, Any] = {"description": self.help}
        if self.kind == "periods":
            told["description"] += f": {self.low:,} to {self.high:,}"
            return {"type": "string", "examples": [self.default_text], "default": self.default_text, **told}
        if self.kind == "time":
            return {"type": ["number", "string"], "examples": ["60 periods", "2 s", 2.0], "minimum": 0, **told}
        told["default"] = self.default
        if self.kind == "choice":
            return {"enum": [value for value, _ in self.choices], **told}
        if self.kind == "flag":
            return {"type": "boolean", **told}
        kind = "integer" if self.kind == "whole" else "number"
        return {"type": kind, "minimum": self.low, "maximum": self.high, **told}


def schemas(fields: dict[str, Described]) -> dict[str, Any]:
    """JSON Schemas by name."""
    return {name: field.schema() for name, field in fields.items()}


def _named(*fields: Described) -> dict[str, Described]:
    return {field.name: field for field in fields}


_READINGS: Final = (
    ("contact", "until the clutch lets go (contact)"), ("literal", "anew at each overtaking (literal)")
)  # fmt: skip
_UNTIL: Final = "run each case until its motion is settled, unless the run has a duration or a window"
_AT_MOST: Final = "excitation periods after which the search for the settled motion ends"
_MAX_PERIOD: Final = "largest number of excitation periods after which a settled motion may repeat"
_SETTLED: Final = "scaled distance from its orbit below which a run counts as settled"
_DURATION: Final = (
    "end of the run, which then lasts for a given time: a number is seconds, a text says periods or a unit of time"
)
_TOLERANCE: Final = "local relative error of the integration"
_RESET: Final = "whether an upward crossing while torque is transmitted restarts the windup (literal)"
_BACKLASH: Final = "whether the angles include the backlash, which is then subtracted"

#: Fields of a run until it is settled.
SETTLED_RUN: Final = _named(
    Described("until", "Each case runs", _UNTIL, "choice", 0, 0, SETTLED, ((SETTLED, "until its motion is settled"),)),
    Described("at_most", "At most", _AT_MOST, "periods", MIN_SETTLED_PERIODS, MAX_SETTLED_PERIODS, 1000),
    Described("settled", "Settled within", _SETTLED, "number", MIN_SETTLED, MAX_SETTLED, 1e-8),
    Described("max_period", "Largest order", _MAX_PERIOD, "whole", 1, MAX_ORBIT_PERIODS, 32),
)
DURATION: Final = Described("duration", "Duration", _DURATION, "time", default="60 periods")
#: Fields of every run.
ANY_RUN: Final = _named(
    Described("tolerance", "Tolerance", _TOLERANCE, "number", MIN_TOLERANCE, MAX_TOLERANCE, 1e-9),
    Described("reset", "Reading of (5)", _RESET, "choice", default="contact", choices=_READINGS),
)
#: Options of the fit of measured clutch data, besides the accuracy.
FIT: Final = _named(
    Described("max_degree", "Highest degree", "highest degree that is tried", "whole", 1, MAX_COEFFICIENTS - 1, 7),
    Described("through_origin", "", "no torque at zero windup (c_1 = 0)", "flag", default=True),
    Described("angles_include_backlash", "", _BACKLASH, "flag", default=False),
)
