"""What the answers with a table have in common: pandas, polars, quantities with units, a look in notebooks."""

from __future__ import annotations

from abc import ABC, abstractmethod
from html import escape
from typing import TYPE_CHECKING, Any, Final

from sprag_study.service.client.sketch import Line, sketch
from sprag_study.service.extras import naming_extra

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl

#: Units of columns that are no quantities of physics.
_COUNTED: Final = frozenset({"", "1"})
#: Most columns that are named where an answer is printed.
_SHOWN: Final = 6


class Tabular(ABC):
    """An answer of the service that is a table. Numbers are SI."""

    __slots__ = ()

    @property
    @abstractmethod
    def units(self) -> dict[str, str]:
        """SI unit of each column that has one."""

    @abstractmethod
    def to_pandas(self) -> pd.DataFrame:
        """The table, with ``attrs["units"]``."""

    @abstractmethod
    def _lines(self) -> tuple[str, str, list[Line]]:
        """Captions of the axes and the curves of a small picture; no curves for none."""

    def __repr__(self) -> str:
        names = list(self.units)
        more = f", and {len(names) - _SHOWN} more columns" if len(names) > _SHOWN else ""
        return f"{type(self).__name__}({', '.join(names[:_SHOWN])}{more})"

    def to_polars(self) -> pl.DataFrame:
        """The same as a polars table, whose missing values are null."""
        return as_polars(self.to_pandas())

    def to_pint(self) -> pd.DataFrame:
        """The same as a pandas table whose columns carry their units, by pint-pandas."""
        return with_units(self.to_pandas())

    def _repr_html_(self) -> str:
        """A small picture in notebooks."""
        x, y, lines = self._lines()
        return sketch(x, y, lines) if lines else f"<pre>{escape(repr(self))}</pre>"


def as_polars(frame: pd.DataFrame) -> pl.DataFrame:
    """A pandas table as a polars table: NaN becomes null."""
    with naming_extra("to_polars", "frames"):
        import polars as pl

    return pl.from_pandas(frame, nan_to_null=True)


def from_arrow(table: Any) -> pl.DataFrame:
    """A table of Arrow as a polars table."""
    with naming_extra("a polars table", "frames"):
        import polars as pl

    frame = pl.from_arrow(table)
    assert isinstance(frame, pl.DataFrame)
    return frame


def with_units(frame: pd.DataFrame) -> pd.DataFrame:
    """A copy of a table of this client whose columns carry the units of ``attrs["units"]``, by pint-pandas.

    Columns that count something or have no unit stay as they are.
    """
    with naming_extra("with_units", "frames"):
        import pint_pandas  # noqa: F401 - registers the type

    units: dict[str, Any] = frame.attrs.get("units", {})
    chosen = {name: f"pint[{unit}]" for name, unit in units.items() if name in frame and unit not in _COUNTED}
    made = frame.astype(chosen)
    made.attrs.update(frame.attrs)
    return made
