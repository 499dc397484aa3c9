"""The structure of a planar linkage: fixed pivots, points on links and groups of two links, in the order of solving.

Each group is an Assur group of class II, a dyad: two links with three joints, each a revolute joint (R) or a sliding
one (P), of which the outer two attach it to what comes before (I. I. Artobolevsky, *Theory of Mechanisms*). The shaft
turns the crank; O is the shaft, A the crank's pin.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, get_args

from sprag_study.sentences import Part, Sentence

ElementKind = Literal["pivot", "point", "RRR", "RRP", "RPR", "RPP", "PRP"]
Branch = Literal["", "left", "right", "ahead", "behind"]
ELEMENT_KINDS: tuple[ElementKind, ...] = get_args(ElementKind)
MAX_ELEMENTS = 40

SHAFT, PIN, FRAME, CRANK = "O", "A", "frame", "crank"
#: Ways to put a group together, the usual one first.
BRANCHES: Mapping[ElementKind, tuple[Branch, ...]] = {
    "RRR": ("left", "right"), "RRP": ("ahead", "behind"), "RPR": ("ahead", "behind"),
}  # fmt: skip
#: Links of each group, by what follows its name.
_LINKS: Mapping[ElementKind, tuple[str, ...]] = {
    "RRR": ("first", "second"), "RRP": ("first", "slider"), "RPR": ("second",), "RPP": ("slider",),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Element:
    """A pivot, a point or a group.

    Attributes
    ----------
    kind : str
        "pivot" is fixed, "point" lies on a link, a group has its kind's name.
    name : str
        Of the joint that it adds, and of its links: ``NAME.first`` from the first outer joint to the inner one,
        ``NAME.second`` from the second outer joint, ``NAME.slider`` what slides on a guide. An RPR adds no joint.
    joints : tuple of str
        The outer revolute joints of a group; of a guide, a point through which its line goes.
    guides : tuple of str
        The links to which the guides are fixed; of a point, its link. ``frame`` does not move.
    branch : str
        RRR: the inner joint is to the "left" or "right" of the line from the first outer joint to the second. RRP: the
        slider is "ahead" or "behind" of the foot of the perpendicular on its guide. RPR: the bar points to the first
        joint ("ahead") or away from it ("behind").
    """

    kind: ElementKind
    name: str
    joints: tuple[str, ...] = ()
    guides: tuple[str, ...] = ()
    branch: Branch = ""

    @property
    def sign(self) -> float:
        """1 for the usual branch, -1 for the other one."""
        return -1.0 if self.branch in {"right", "behind"} else 1.0

    @property
    def links(self) -> tuple[str, ...]:
        """Names of its links."""
        return tuple(f"{self.name}.{link}" for link in _LINKS.get(self.kind, ()))


@dataclass(frozen=True, slots=True)
class LinkageChoice:
    """A planar linkage; ``working`` is the joint of the working part, "" for none, and ``reversed`` turns its way."""

    elements: tuple[Element, ...] = ()
    working: str = ""
    reversed: bool = False

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> "LinkageChoice":
        """The choice of its plain data."""
        elements = tuple(
            Element(**{**each, "joints": tuple(each.get("joints", ())), "guides": tuple(each.get("guides", ()))})
            for each in data["elements"]
        )
        return cls(elements, data.get("working", ""), data.get("reversed", False))

    def to_json(self) -> dict[str, Any]:
        """Plain data that ``from_json`` reads."""
        elements = [
            {"kind": each.kind, "name": each.name, "joints": list(each.joints), "guides": list(each.guides),
             "branch": each.branch}
            for each in self.elements
        ]  # fmt: skip
        return {"elements": elements, "working": self.working, "reversed": self.reversed}


class ElementFault(NamedTuple):
    """What is wrong with a linkage: the number of the element (None: its working part), the field, and why."""

    element: int | None
    field: str
    value: str
    message: Sentence
    allowed: Sentence


def _names(names: Iterator[str]) -> Sentence:
    listed: Part = ", ".join(names)
    return Sentence("one of {names}", names=listed)


def element_faults(choice: LinkageChoice) -> Iterator[ElementFault]:
    """Names that are taken or not known at their place, and a working part whose way is no line and no arc."""
    joints, links = [SHAFT, PIN], [FRAME, CRANK]
    for index, each in enumerate(choice.elements):
        taken = {*joints, *links}
        if each.name in taken or f"{each.name}.second" in taken:
            message = Sentence("is the name of another joint or link")
            yield ElementFault(index, "name", each.name, message, Sentence("a name of its own"))
        for field, joint in zip(("from", "to"), each.joints, strict=False):
            if joint not in joints:
                message = Sentence("is no joint that stands before it in the list")
                yield ElementFault(index, field, joint, message, _names(iter(joints)))
        outer = each.joints
        if each.kind in {"RRR", "RPR"} and len(outer) == 2 and outer[0] == outer[1] and outer[0] in joints:
            message = Sentence("is the joint at its other end, too")
            yield ElementFault(index, "to", outer[1], message, _names(joint for joint in joints if joint != outer[0]))
        for field, link in zip(("on",) if each.kind == "point" else ("guide", "guide_2"), each.guides, strict=False):
            if link not in links:
                message = Sentence("is no link that stands before it in the list")
                yield ElementFault(index, field, link, message, _names(iter(links)))
        yield from _lines_off_their_links(choice, index, joints, links)
        if each.kind != "RPR":
            joints.append(each.name)
        links += each.links
    if choice.working and working_link(choice) is None:
        message = Sentence(
            "neither slides on a guide of the frame nor moves on an arc about a fixed pivot: its travel is no stroke"
        )
        able = [each.name for each in choice.elements if working_link(choice, each.name) is not None]
        allowed = _names(iter(able)) if able else Sentence("no working part")
        yield ElementFault(None, "working", choice.working, message, allowed)


def _lines_off_their_links(
    choice: LinkageChoice, index: int, joints: list[str], links: list[str]
) -> Iterator[ElementFault]:
    """Guides whose line goes through a joint that is not on their link."""
    each = choice.elements[index]
    if each.kind == "point" or not each.guides:
        return
    fields = ("from", "to") if each.kind == "PRP" else ("to",)
    through = each.joints if each.kind == "PRP" else each.joints[1:]
    for field, joint, link in zip(fields, through, each.guides, strict=False):
        if joint not in joints or link not in links:
            continue
        able = joints_on(choice, link, index)
        if joint not in able:
            message = Sentence("is not on {link}, to which the guide is fixed", link=link)
            yield ElementFault(index, field, joint, message, _names(iter(able)))


def joints_on(choice: LinkageChoice, link: str, before: int) -> list[str]:
    """The joints on a link that the elements ``before`` an index give."""
    named = {FRAME: [SHAFT], CRANK: [SHAFT, PIN]}.get(link, [])
    for each in choice.elements[:before]:
        if (each.kind == "pivot" and link == FRAME) or (each.kind == "point" and each.guides == (link,)):
            named.append(each.name)
        elif link in each.links:
            outer = {"first": each.joints[:1], "second": each.joints[1:]}.get(link.rpartition(".")[2], ())
            named += [*outer, *([] if each.kind == "RPR" else [each.name])]
    return named


def fixed_joints(choice: LinkageChoice) -> set[str]:
    """Names of the joints that do not move."""
    return {SHAFT} | {
        each.name for each in choice.elements
        if each.kind == "pivot" or (each.kind == "point" and each.guides == (FRAME,))
    }  # fmt: skip


def link_pivots(choice: LinkageChoice) -> dict[str, str]:
    """Link -> the joint from which its points are counted: the outer one of a group."""
    pivots = {FRAME: SHAFT, CRANK: SHAFT}
    for each in choice.elements:
        if each.kind == "RRR":
            pivots |= {each.links[0]: each.joints[0], each.links[1]: each.joints[1]}
        elif each.kind == "RRP":
            pivots |= {each.links[0]: each.joints[0], each.links[1]: each.name}
        elif each.kind == "RPR":
            pivots[each.links[0]] = each.joints[1]
        elif each.kind == "RPP":
            pivots[each.links[0]] = each.name
    return pivots


def working_link(choice: LinkageChoice, name: str | None = None) -> str | None:
    """The link of the working part: one that turns about a fixed pivot, or ``frame`` where it slides on a fixed guide.

    None where the joint ``name``, by default ``working``, does neither.
    """
    name = choice.working if name is None else name
    each = next((each for each in choice.elements if each.name == name), None)
    fixed, pivots = fixed_joints(choice), link_pivots(choice)
    if each is None:
        return None
    if each.kind in {"RRP", "RPP"}:
        return FRAME if each.guides == (FRAME,) and each.joints[1] in fixed else None
    candidates = each.links[::-1] if each.kind == "RRR" else each.guides if each.kind == "point" else ()
    turning = (link for link in candidates if link not in {FRAME, CRANK} and pivots.get(link) in fixed)
    return next(turning, None)
