"""Studies side by side: the inputs in which they differ, and the same curves of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sprag_study.service.answers.differing import differing, unique_names
from sprag_study.service.client.tabular import Tabular
from sprag_study.service.extras import naming_extra

if TYPE_CHECKING:
    import pandas as pd

    from sprag_study.service.answers.studies import StudyDetail
    from sprag_study.service.client.frames import Curves
    from sprag_study.service.client.queries import Held
    from sprag_study.service.client.sketch import Line


@dataclass(frozen=True, slots=True, repr=False)
class Comparison(Tabular):
    """Studies side by side. ``names`` are unique; ``inputs`` has, by JSON Pointer into the spec, what differs.

    ``curves`` has those of each study, or nothing where no parameter varies in all of them.
    """

    names: tuple[str, ...]
    inputs: dict[str, tuple[Any, ...]]
    curves: tuple[Curves, ...]

    @property
    def units(self) -> dict[str, str]:
        """SI unit of each column that has one."""
        return {name: unit for curves in self.curves for name, unit in curves.units.items()}

    def to_pandas(self) -> pd.DataFrame:
        """A row for each point of each study, whose name is in the column ``study``; ``attrs["units"]``.

        Raises ValueError where there are no curves.
        """
        if not self.curves:
            raise ValueError("these studies have no varying parameter in common, so they have no curves to compare")
        with naming_extra("Comparison.to_pandas", "tables"):
            import pandas as pd

        tables = [curves.to_pandas() for curves in self.curves]
        for name, table in zip(self.names, tables, strict=True):
            table.insert(0, "study", name)
        joined = pd.concat(tables, ignore_index=True)
        joined.attrs["units"] = self.units
        return joined

    def differences(self) -> pd.DataFrame:
        """A row for each input in which the studies differ, a column for each study; None where it has none."""
        with naming_extra("Comparison.differences", "tables"):
            import pandas as pd

        table = pd.DataFrame(self.inputs.values(), index=list(self.inputs), columns=list(self.names), dtype=object)
        return table.rename_axis(index="input")

    def _lines(self) -> tuple[str, str, list[Line]]:
        drawn = [curves._lines() for curves in self.curves] or [("", "", [])]
        return drawn[0][0], drawn[0][1], [lines[0] for _, _, lines in drawn if lines]


def held_in(detail: StudyDetail, details: Sequence[StudyDetail], at: Held | None) -> Held:
    """The values ``at`` which a study is held: those of its axes, and of what no study has, for it to be refused."""
    own, *_ = paths = [{path for axis in each["axes"] for path in axis["paths"]} for each in (detail, *details)]
    return {path: value for path, value in (at or {}).items() if path in own or not any(path in each for each in paths)}


def compared(details: Sequence[StudyDetail], curves: Sequence[Curves]) -> Comparison:
    """The comparison of studies and of one set of curves for each."""
    names = unique_names([detail["name"] for detail in details], [detail["id"] for detail in details])
    return Comparison(tuple(names), differing([detail["spec"] for detail in details]), tuple(curves))
