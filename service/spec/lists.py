"""Lists and ranges of quantities of a spec, whose items are read together."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from sprag.sentences import Place
from sprag.service.reading.numbers import assumption, settle, settled
from sprag.service.reading.printed import could_be_values
from sprag.service.reading.together import AMBIGUOUS_UNIT, questions, split_list, with_last_unit

if TYPE_CHECKING:
    from sprag.service.spec.report import Report


def refuse_mixed(report: Report, items: Iterable[tuple[str, object]], unit: str | Sequence[str]) -> bool:
    """Record a fault for each bare number beside quantities in units of another scale; whether there is one.

    ``items`` are JSON Pointers with their values, ``unit`` is their SI unit, or that of each.
    """
    pairs = list(items)
    units = [unit] * len(pairs) if isinstance(unit, str) else unit
    asked = questions([value for _, value in pairs], units)
    for one in asked:
        pointer, value = pairs[one.place]
        report.fault(pointer, AMBIGUOUS_UNIT, one.message, value, allowed=one.allowed, unit=units[one.place])
    return bool(asked)


def refuse_blanks(report: Report, items: Iterable[tuple[str, object]]) -> bool:
    """Record a fault where an item of a list could also be several values between blanks; whether there is one.

    ``items`` are JSON Pointers with their values.
    """
    written = [(pointer, value) for pointer, value in items if isinstance(value, str)]
    place = could_be_values([text for _, text in written])
    if place is None:
        return False
    pointer, text = written[place]
    report.fault(
        pointer, "invalid-text", "could be one value or several", text, allowed="separate values, or no blanks"
    )
    return True


def read_list(
    report: Report, items: Sequence[tuple[str, object]], unit: str | Sequence[str], about: str = ""
) -> list[object] | None:
    """As `read_together`, of a list, whose items could also be several values between blanks."""
    return None if refuse_blanks(report, items) else read_together(report, items, unit, about)


def read_together(
    report: Report, items: Sequence[tuple[str, object]], unit: str | Sequence[str], about: str = ""
) -> list[object] | None:
    """The items of one list or range, their texts with decimal points; None, and faults recorded, where one is unclear.

    ``items`` are JSON Pointers with their values, ``unit`` is their SI unit, or that of each, and ``about`` is the path
    that varies, where the pointers do not say it. Points that could separate thousands and that no other item settles
    are decimal, with a warning.
    """
    written = [(pointer, value) for pointer, value in items if isinstance(value, str)]
    texts, doubt = settle([text for _, text in written])
    rest = iter(texts)
    pairs = [(pointer, next(rest) if isinstance(value, str) else value) for pointer, value in items]
    if refuse_mixed(report, pairs, unit):
        return None
    if doubt is not None:
        pointer, text = written[doubt]
        report.warn("ambiguous-point", Place(pointer, about), assumption(text))
    return [value for _, value in pairs]


def read_list_text(report: Report, pointer: str, text: str, unit: str, about: str = "") -> list[object] | None:
    """The items of a list that is one text, such as ``0; 50; 100 N*mm``; None, and faults recorded, where unclear."""
    typed = split_list(text)
    if len(typed) == 1 and "," in typed[0]:
        report.fault(
            pointer, "invalid-text", "could be one value or several", text,
            allowed="values separated by semicolons, or a list of them",
        )  # fmt: skip
        return None
    return read_list(report, [(pointer, item) for item in with_last_unit(settled(typed))], unit, about)
