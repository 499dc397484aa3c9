"""Why a transient ended, for its reader: the engine's English sentence found again, with its numbers as quantities."""

from __future__ import annotations

import math
import re
from functools import cache
from typing import Final

from sprag_study.sentences import Amount
from sprag_study.service.languages import N_
from sprag_study.service.reading.reader import Phrase

#: The words for outcomes, of which `term` makes phrases.
_OUTCOMES: Final = (
    N_("reached"), N_("not reached"), N_("stopped"), N_("not started"), N_("too stiff"),
)  # fmt: skip
_CAUSES: Final = (
    N_(
        "The motion was followed for {time} and {turns} revolutions only: the drive reacts too fast to the speed, or "
        "the shaft has too little inertia for it."
    ),
    N_("The shaft comes to its steady cycle after {time} and {turns} revolutions."),
    N_(
        "The shaft comes to its steady cycle after {time} and {turns} revolutions, to {share} % of the first "
        "difference in speed."
    ),
    N_("The shaft comes to the new steady cycle after {time} and {turns} revolutions."),
    N_(
        "The shaft comes to the new steady cycle after {time} and {turns} revolutions, to {share} % of the first "
        "difference in speed."
    ),
    N_(
        "The shaft still turns at {speed} after {time} and {turns} revolutions: nothing takes work from it over a "
        "cycle."
    ),
    N_("The shaft still turns at {speed} after {time} and {turns} revolutions: more revolutions are needed."),
    N_(
        "The shaft still turns at {speed} after {time} and {turns} revolutions and has not come to the steady cycle: "
        "more revolutions are needed, or it settles at another speed."
    ),
    N_("The shaft still turns at {speed} after {time} and {turns} revolutions; it comes to no steady cycle. {why}"),
    N_("The shaft still turns at {speed} after {time} and {turns} revolutions; it comes to no steady cycle."),
    N_("The shaft stops after {time} and {turns} revolutions."),
    N_("The shaft stops after {time} and {turns} revolutions. Weights and springs then turn it back."),
    N_(
        "The shaft does not start: at {place} the torque of the drive at rest, {drive}, does not exceed the resisting "
        "torque, {resistance}."
    ),
    N_(
        "The shaft stops at {place}, after {time} and {turns} revolutions: the mean resisting torque, {resistance}, "
        "exceeds the largest torque of the drive, {drive}."
    ),
    N_(
        "The shaft stops at {place}, after {time} and {turns} revolutions: its energy is spent. The resisting torque "
        "there is {resistance}, the torque of the drive at rest {drive}."
    ),
)
#: Causes without numbers, and why there is no steady cycle.
_WHOLE: Final = (
    N_(
        "The load is not smooth in the speed: a transient needs a formula without abs, sign, step, floor, mod, min, "
        "max or comparisons of omega."
    ),
    N_("The torque of the drive does not follow the speed, so it balances no other load."),
)
#: What the engine writes after each number, and the SI unit and its factor.
_UNITS: Final = {
    "time": (" s", "s", 1.0),
    "speed": (" rad/s", "rad/s", 1.0),
    "place": (" deg", "rad", math.pi / 180.0),
    "drive": (" N*m", "N*m", 1.0),
    "resistance": (" N*m", "N*m", 1.0),
    "turns": ("", "1", 1.0),
    "share": ("", "1", 1.0),
}
#: Digits of the engine's numbers.
_DIGITS: Final = 4


def cause_phrase(cause: str) -> Phrase:
    """The sentence in its reader's language and units."""
    for text in _CAUSES:
        if (found := _pattern(text).fullmatch(cause)) is not None:
            return Phrase(text, **{name: _part(name, value) for name, value in found.groupdict().items()})
    return Phrase(cause)


def _part(name: str, value: str) -> Phrase | Amount:
    if name not in _UNITS:
        return Phrase(value)
    _, unit, factor = _UNITS[name]
    return Amount(factor * float(value), unit, _DIGITS)


@cache
def _pattern(text: str) -> re.Pattern[str]:
    pieces = re.split(r"\{(\w+)\}", text)
    return re.compile("".join(_group(piece) if place % 2 else re.escape(piece) for place, piece in enumerate(pieces)))


def _group(name: str) -> str:
    if name not in _UNITS:
        return f"(?P<{name}>.+)"
    return rf"(?P<{name}>[-+\d.e]+|nan|inf){re.escape(_UNITS[name][0])}"
