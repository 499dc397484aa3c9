"""The operating points of a goal, which have names, and at which of them a goal or a limit counts."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from sprag_study.sentences import Sentence
from sprag_study.service.reading.limits import quoted
from sprag_study.service.reading.texts import did_you_mean
from sprag_study.service.spec.schema.quantity import QUANTITY
from sprag_study.worker.study import SAME_VALUE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.spec.node import Node

#: Field with the name of a point.
NAME: Final = "name"
#: JSON Schema of the name of an operating point, which stands in names of results.
POINT_NAME: Final = r"""^[^\s<>=≤≥(),;"'][^<>=≤≥(),;"'\n]{0,39}$"""
#: JSON Schema of the points that count.
AT: Final[dict[str, Any]] = {
    "anyOf": [
        {"type": "string", "minLength": 1},
        {"type": "object", "minProperties": 1, "additionalProperties": QUANTITY},
    ],
    "description": "the operating points that count: the one of that name, or those with these values; by default all",
}


class Places:
    """The operating points of a goal, to be named by goals and limits.

    Attributes
    ----------
    points : path -> value (SI), of each
    names : of each, "" without one
    """

    def __init__(self, node: Node, items: Sequence[Node], points: Sequence[Mapping[str, float]]) -> None:
        self.points = points
        self.names = [self._name(item) for item in items]
        for index, name in enumerate(self.names):
            if name and name in self.names[:index]:
                node[index][NAME].refuse("repeated", "is the name of another point", name, allowed="each name once")

    @staticmethod
    def _name(item: Node) -> str:
        name = item[NAME]
        if not name.given:
            return ""
        if isinstance(name.value, str) and re.match(POINT_NAME, name.value):
            return name.value
        name.refuse("invalid-text", "is not a name of an operating point",
                    allowed="1 to 40 characters other than < > = ( ) , ; and quotation marks")  # fmt: skip
        return ""

    def read(self, item: Node) -> dict[str, Any] | None:
        """Which points count for a goal or a limit, and what they are called; empty for all of them.

        None, and a fault recorded, where it names none.
        """
        node = item["at"]
        if not node.given:
            return {}
        if not self.points:
            node.refuse(
                "conflict", "names an operating point, of which the goal has none", allowed="`at` of the goal, too"
            )
            return None
        if isinstance(node.value, str):
            return self._named(node)
        if not isinstance(node.value, Mapping) or not node.value:
            node.refuse("wrong-type", "must be the name of an operating point, or an object with values of it",
                        allowed='as in "idle" or {"shaft.load": "0.2 N*m"}')  # fmt: skip
            return None
        known, values = tuple(self.points[0]), dict[str, float]()
        for path in node.value:
            if path not in known:
                node[path].refuse(
                    "invalid-path", "is not a parameter of the operating points", path, allowed=", ".join(known)
                )
            elif (number := node[path].number(node.machine.parameters[path])) is not None:
                values[path] = number
        if not node.sound:
            return None
        at = [
            place for place, point in enumerate(self.points)
            if all(math.isclose(point[path], value, rel_tol=SAME_VALUE) for path, value in values.items())
        ]  # fmt: skip
        if not at:
            node.refuse("unknown-value", "is at no operating point of the goal", None, allowed="values of one of them")
            return None
        texts = [self.names[place] or f"point {place + 1}" for place in at]
        return {} if len(at) == len(self.points) else {"at": at, "where": " and ".join(texts)}

    def _named(self, node: Node) -> dict[str, Any] | None:
        if node.value in self.names and node.value:
            return {"at": [self.names.index(node.value)], "where": node.value}
        known = [name for name in self.names if name]
        hint = did_you_mean(node.value, known)
        message = Sentence("is not the name of an operating point{hint}", hint=hint)
        node.refuse("unknown-name", message, allowed=quoted(known) if known else "`name` in a point of `at`")
        return None
