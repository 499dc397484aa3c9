"""A study while its spec is read, and what a kind of study has to offer."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sprag_study.worker.study import Axis, Combine, Study

if TYPE_CHECKING:
    from sprag_study.service.spec.described import Field
    from sprag_study.service.spec.node import Node
    from sprag_study.worker.models import Quantity
    from sprag_study.worker.spread import Spread


@dataclass
class Draft:
    """What is known of a study; kinds of studies add to it until it is put together.

    Attributes
    ----------
    spec : the whole spec
    kind : "refine", "goal" or "calibrate" where the study chooses its own cases, otherwise ""
    axes : None where they could not be read; of a study that chooses its own cases, the ends of what it may choose,
        until its first round is known
    fresh : drives that are drawn beside those of the spec, for the best designs of a search
    others : as in a `Study`
    """

    spec: Node
    model: str
    name: str
    kind: str = ""
    axes: tuple[Axis, ...] | None = None
    combine: Combine = "zip"
    run: dict[str, Any] = field(default_factory=dict)
    plan: dict[str, Any] | None = None
    spread: Spread | None = None
    fresh: int = 0
    sweep: str | None = None
    quantities: tuple[Quantity, ...] = ()

    @property
    def cases(self) -> int:
        """Number of cases of these axes; 1 without axes."""
        lengths = [len(axis) for axis in self.axes or ()]
        return math.prod(lengths if self.combine == "grid" else lengths[:1])

    def vary(self, ends: Sequence[tuple[tuple[str, ...], Sequence[float]]]) -> None:
        """Let tied paths vary over these values: axes of one length, on which shorter lists begin again."""
        length = max((len(values) for _, values in ends), default=0)
        self.axes = tuple(
            Axis(paths, np.resize(np.asarray(values, dtype=np.float64), length)) for paths, values in ends
        )

    def study(self) -> Study:
        """The study, its base with sorted paths, so that equal machines are stored identically."""
        machine = self.spec.machine
        base = {path: machine.values[path] + 0.0 for path in sorted(machine.values)}
        return Study(
            self.model, self.name, base, self.run, self.axes or (), self.combine, machine.structure, self.plan,
            machine.derive, self.spread, self.sweep, self.quantities,
            machine.components,
        )  # fmt: skip


#: Adds to a draft what needs the whole of machine, run and cases; SpecError where it cannot.
Finish = Callable[[], None]


class Kind(NamedTuple):
    """A kind of study.

    Attributes
    ----------
    fields : its fields of the spec with their descriptions
    read : reads them, records their faults, and returns what is left to do; None where nothing is
    chooses : whether its fields say which cases the study has, so that a study of other cases drops them; of kinds
        that `cases` reads, `cases` says it
    """

    fields: Mapping[str, Field]
    read: Callable[[Draft], Finish | None]
    chooses: bool = False
