"""Lists and ranges of quantities of a spec, whose items are read together."""

from __future__ import annotations

from collections.abc import Sequence

from sprag_study.sentences import Place
from sprag_study.service.reading.numbers import assumption, settle, settled
from sprag_study.service.reading.printed import could_be_values
from sprag_study.service.reading.ranges import could_be_several
from sprag_study.service.reading.together import AMBIGUOUS_UNIT, questions, split_list, with_last_unit
from sprag_study.service.spec.node import Node


def refuse_mixed(nodes: Sequence[Node], unit: str | Sequence[str]) -> bool:
    """Record a fault for each bare number beside quantities in units of another scale; whether there is one.

    ``unit`` is their SI unit, or that of each.
    """
    units = [unit] * len(nodes) if isinstance(unit, str) else unit
    asked = questions([node.value for node in nodes], units)
    for one in asked:
        nodes[one.place].refuse(AMBIGUOUS_UNIT, one.message, allowed=one.allowed, unit=units[one.place])
    return bool(asked)


def refuse_blanks(nodes: Sequence[Node]) -> bool:
    """Record a fault where an item of a list could also be several values between blanks; whether there is one."""
    written = [node for node in nodes if isinstance(node.value, str)]
    place = could_be_values([node.value for node in written])
    if place is None:
        place = next((place for place, node in enumerate(written) if could_be_several(node.value)), None)
    if place is None:
        return False
    written[place].refuse("invalid-text", "could be one value or several", allowed="separate values, or no blanks")
    return True


def read_list(nodes: Sequence[Node], unit: str | Sequence[str], about: str = "") -> Sequence[Node] | None:
    """As `read_together`, of a list, whose items could also be several values between blanks."""
    return None if refuse_blanks(nodes) else read_together(nodes, unit, about)


def read_together(nodes: Sequence[Node], unit: str | Sequence[str], about: str = "") -> Sequence[Node] | None:
    """The items of one list or range, their texts with decimal points; None, and faults recorded, where one is unclear.

    ``unit`` is their SI unit, or that of each, and ``about`` is the path that varies, where the pointers do not say it.
    Points that could separate thousands and that no other item settles are decimal, with a warning.
    """
    written = [node for node in nodes if isinstance(node.value, str)]
    texts, doubt = settle([node.value for node in written])
    doubtful = None if doubt is None else (written[doubt], written[doubt].value)
    for node, text in zip(written, texts, strict=True):
        node.value = text
    if refuse_mixed(nodes, unit):
        return None
    if doubtful is not None:
        node, text = doubtful
        node.report.warn("ambiguous-point", Place(node.pointer, about), assumption(text))
    return nodes


def read_list_text(node: Node, unit: str, about: str = "") -> Sequence[Node] | None:
    """The items of a list that is one text, such as ``0; 50; 100 N*mm``; None, and faults recorded, where unclear."""
    typed = split_list(node.value)
    if len(typed) == 1 and "," in typed[0]:
        node.refuse("invalid-text", "could be one value or several",
                    allowed="values separated by semicolons, or a list of them")  # fmt: skip
        return None
    items = [node.holding(item) for item in with_last_unit(settled(typed))]
    return read_list(items, unit, about)
