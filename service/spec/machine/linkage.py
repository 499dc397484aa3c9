"""A planar linkage in a spec: pivots, points on links and groups of two links, in the order of solving."""

from __future__ import annotations

import re
from typing import Any, Final

from sprag_study.sentences import Sentence
from sprag_study.service.languages import N_
from sprag_study.service.spec.described import Field, Listed, Record, choice
from sprag_study.service.spec.machine.shaft_numbers import numbers_of, numbers_under, refuse_foreign
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.schema.quantity import required_of
from sprag_study.worker.models import machine_shaft
from sprag_study.worker.models.machine_shaft import BRANCHES, ELEMENT_KINDS, FRAME, SHAFT, LinkageChoice

_NAME: Final = re.compile(r"[A-Za-z][A-Za-z_0-9]{0,39}")
_A_NAME: Final = "letters, digits and _, at most 40, a letter first"
KIND: Final = choice(
    "kind", "a fixed pivot, a point on a link, or a group of two links by its joints: revolute R, sliding P",
    *ELEMENT_KINDS,
)  # fmt: skip
BRANCH: Final = choice(
    "branch",
    "RRR: the inner joint is left or right of the way between its outer ones; RRP, RPR: the slider, or the bar, is "
    "ahead or behind",
    *dict.fromkeys(branch for branches in BRANCHES.values() for branch in branches),
)  # fmt: skip
FORWARD: Final = choice(
    "forward", "forward stroke along the guide or counterclockwise, or the other way", "positive", "negative",
    default="positive",
)  # fmt: skip
_TEXTS: Final[dict[str, str]] = {
    "name": "of the joint that it adds; links are NAME.first, NAME.second, NAME.slider",
    "from": "outer joint of the first link; O is the shaft, A the crank's pin",
    "to": "outer joint of the second link, or joint through which the guide goes; by default O for a guide",
    "guide": "link to which the guide is fixed; by default frame",
    "guide_2": "link to which the second guide is fixed; by default frame",
    "on": "link of the point: frame, crank or one of a group",
}
_NUMBERS: Final = numbers_under("mechanism.linkage.elements.K.")


def _text(meaning: str) -> Field:
    return {"type": "string", "minLength": 1, "description": meaning}


_ELEMENT: Final = Record(
    {"kind": KIND, **{name: _text(meaning) for name, meaning in _TEXTS.items()}, "branch": BRANCH, **_NUMBERS},
    required=("kind", "name"),
)
ELEMENTS: Final = Listed(
    "elements", 1, machine_shaft.MAX_ELEMENTS, "pivots, points and groups, each after those to which it is attached",
    item=_ELEMENT,
)  # fmt: skip
_OWN: Final = numbers_under("mechanism.linkage.")
LINKAGE: Final = Record(
    {
        **_OWN,
        "elements": ELEMENTS,
        "working": _text("joint of the working part: a slider on the frame, or a joint on an arc; by default none"),
        "forward": FORWARD,
    },
    "a planar linkage of one's own: a crank, and groups of two links that are attached to it one after the other",
    required=(*required_of(_OWN), "elements"),
)
#: Names that elements of each kind have: joints, and links to which something is fixed.
_JOINTS: Final = {"pivot": (), "point": (), **dict.fromkeys(("RRR", "RRP", "RPR", "RPP", "PRP"), ("from", "to"))}
_LINKS: Final = {"point": ("on",), "RRP": ("guide",), "RPP": ("guide",), "PRP": ("guide", "guide_2")}
_OTHERWISE: Final = {"guide": FRAME, "guide_2": FRAME}
_KINDS_OF_ELEMENTS: Final = N_("an element of the kind {kind}")


def read_linkage(node: Node) -> dict[str, Any] | None:
    """Read the structure of a linkage; None, with the faults recorded, where it is not sound."""
    if not LINKAGE.read(node):
        return None
    elements = [_read_element(item) for item in ELEMENTS.read(node["elements"]) or ()]
    working, forward = node["working"], FORWARD.read(node)
    if working.given and not isinstance(working.value, str):
        working.refuse("wrong-type", "must be a text", allowed="the name of a joint")
    known = [element for element in elements if element is not None]
    if not node.sound or len(known) < len(elements):
        return None
    linkage = {"elements": known, "working": working.value or "", "reversed": forward == "negative"}
    for fault in machine_shaft.element_faults(LinkageChoice.from_json(linkage)):
        place = node[fault.field] if fault.element is None else node["elements"][fault.element][fault.field]
        place.refuse("conflict", fault.message, fault.value, allowed=fault.allowed)
    return linkage if node.sound else None


def _read_element(node: Node) -> dict[str, Any] | None:
    kind = KIND.read(node) if _ELEMENT.read(node) else None
    if kind is None:
        return None
    joints, links = _JOINTS[kind], _LINKS.get(kind, ())
    numbers = numbers_of(
        {"mechanism": {"kind": "linkage", "linkage": {"elements": [{"kind": kind, "name": "X"}]}}},
        "mechanism.linkage.elements.0.",
    )
    branches = BRANCHES.get(kind, ())
    own = ("kind", "name", *joints, *links, *(["branch"] if branches else []), *numbers)
    refuse_foreign(node, own, Sentence(_KINDS_OF_ELEMENTS, kind=kind))
    name = node["name"]
    if not isinstance(name.value, str) or not _NAME.fullmatch(name.value):
        if name.value is None:
            name.refuse("required", "is required", allowed=_A_NAME)
        else:
            name.refuse("invalid-text", "is not a valid name for an element", allowed=_A_NAME)
    branch = node["branch"].choice(branches) if branches and "branch" in node else next(iter(branches), "")
    named = [_read_name(node[field], SHAFT if field == "to" and links else _OTHERWISE.get(field))
             for field in (*joints, *links)]  # fmt: skip
    if not node.sound:
        return None
    return {"kind": kind, "name": name.value, "joints": named[: len(joints)], "guides": named[len(joints) :],
            "branch": branch}  # fmt: skip


def _read_name(node: Node, default: str | None) -> str | None:
    """The name of a joint or a link; whether the linkage has it is asked of the whole."""
    if not node.given and default is not None:
        return default
    if isinstance(node.value, str) and node.value:
        return node.value
    node.mistake("must be a text", allowed="the name of a joint or a link")
    return None
