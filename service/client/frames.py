"""Answers as pandas tables and xarray grids. Both libraries are loaded on first use."""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from sprag_study.service.client.tabular import Tabular
from sprag_study.service.extras import naming_extra
from sprag_study.service.formats import NAME_ATTRIBUTE
from sprag_study.worker.codes import ENDING_CODES, PENDING, REGIME_CODES

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pandas as pd
    import polars as pl
    import xarray as xr

    from sprag_study.service.answers.results import CaseDetail, CurvesData
    from sprag_study.service.client.sketch import Line


@dataclass(frozen=True, slots=True)
class _Coded:
    """A column of names that grids have as numbers: those of the NetCDF files, and the name where there is none."""

    codes: dict[str, int]
    missing: str
    dtype: str
    meaning: str

    def numbers(self, column: pd.Series[Any]) -> pd.Series[int]:
        """The numbers of the names of a column; raises ValueError for an unknown name."""
        names = column.where(column.notna(), self.missing)
        if unknown := set(names) - set(self.codes):
            text = f"the {column.name} {min(unknown)!r} is unknown to this version of the client"
            raise ValueError(f"{text}; see `to_pandas`")
        return names.map(self.codes)

    @property
    def attributes(self) -> dict[str, Any]:
        """The attributes of a variable of such numbers."""
        return {
            "long_name": self.meaning,
            "flag_values": list(self.codes.values()),
            "flag_meanings": " ".join(self.codes),
        }


_CODED: Final = {
    "regime": _Coded(REGIME_CODES, "none", "int8", f"what the motion settles to: {', '.join(list(REGIME_CODES)[1:])}"),
    "ending": _Coded(ENDING_CODES, PENDING, "int16", "how the case ended"),
}
_ORDER_MEANING: Final = "excitation periods after which the motion repeats itself"


@dataclass(frozen=True, slots=True, repr=False)
class Curves(Tabular):
    """Curves of results against one axis; ``data`` is the answer of the service. SI units."""

    data: CurvesData

    @property
    def units(self) -> dict[str, str]:
        """Unit of every parameter and result in the table."""
        return {**self.data["units"], **{name: info["unit"] for name, info in self.data["results"].items()}}

    def to_pandas(self) -> pd.DataFrame:
        """A row for each point: the parameters of its curve, x, results (NaN for none), regime, order, ending, case."""
        with naming_extra("Curves.to_pandas", "tables"):
            import pandas as pd

        x = self.data["x"]["path"]
        parts = [
            pd.DataFrame(
                {
                    **{path: [value] * len(curve["x"]) for path, value in {**curve["by"], **curve["at"]}.items()},
                    x: curve["x"],
                    **{name: pd.Series(values, dtype="float64") for name, values in curve["y"].items()},
                    **({"regime": curve["regime"]} if "regime" in curve else {}),
                    **({"order": pd.Series(curve["order"], dtype="Int64")} if "order" in curve else {}),
                    "ending": curve["endings"],
                    "case": curve["cases"],
                }
            )
            for curve in self.data["curves"]
        ]
        table = pd.concat(parts, ignore_index=True)
        table.attrs["units"] = self.units
        return table

    def to_xarray(self) -> xr.Dataset:
        """A grid of the results over x and the parameters of the curves, with units as attributes.

        ``ending`` has the codes of the NetCDF files (attributes ``flag_values`` and ``flag_meanings``, -1 pending), and
        ``case`` the number of the case, a coordinate; both are -1 where the grid has no point. Of a settled study,
        ``regime`` has codes as well (0 none), and ``order`` is NaN where the motion does not repeat.

        Raises ValueError when two points have the same parameters, which zipped cases can, or for an unknown ending or
        regime.
        """
        with naming_extra("Curves.to_xarray", "tables"):
            import xarray  # noqa: F401 - pandas uses it

        names = list(self.data["results"])
        dims = [*self.data["curves"][0]["by"], self.data["x"]["path"]]
        table = self.to_pandas()
        coded = {name: kind for name, kind in _CODED.items() if name in table}
        for name, kind in coded.items():
            table[name] = kind.numbers(table[name])
        order = ["order"] if "order" in table else []
        indexed = table.set_index(dims)[[*names, *coded, *order, "case"]]
        if not indexed.index.is_unique:
            raise ValueError("several points have the same parameters, so they do not form a grid; see `to_pandas`")
        grid = indexed.to_xarray()
        for name in (*dims, *names):
            grid[name].attrs["units"] = self.units[name]
        for name in names:
            grid[name].attrs["long_name"] = self.data["results"][name]["description"]
        for name, kind in coded.items():
            grid[name] = grid[name].fillna(kind.codes[kind.missing]).astype(kind.dtype)
            grid[name].attrs = kind.attributes
        for name in order:
            grid[name] = grid[name].astype("float64")
            grid[name].attrs = {"units": "1", "long_name": _ORDER_MEANING}
        grid["case"] = grid["case"].fillna(-1).astype("int64")
        grid["case"].attrs = {"units": "1", "long_name": "number of the case"}
        return grid.set_coords("case")

    def _lines(self) -> tuple[str, str, list[Line]]:
        x, (name, info) = self.data["x"], next(iter(self.data["results"].items()))
        lines: list[Line] = [(curve["x"], curve["y"][name]) for curve in self.data["curves"]]
        return f"{x['path']} in {x['unit']}", f"{name} in {info['unit']}", lines


def table_of(parquet: bytes) -> pd.DataFrame:
    """All rows of a study, from its Parquet file, whose metadata have the units."""
    with naming_extra("a table", "tables"):
        import pandas as pd
        import pyarrow  # noqa: F401 - pandas uses it

    table = pd.read_parquet(io.BytesIO(parquet))
    table.attrs["units"] = units_of(arrow_of(parquet).schema_arrow)
    table.attrs["endings"] = {str(name): int(count) for name, count in table["ending"].value_counts().items()}
    return table


def arrow_of(parquet: bytes) -> Any:
    """The Parquet file of the rows of a study, opened (`pyarrow.parquet.ParquetFile`)."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    return pq.ParquetFile(pa.BufferReader(parquet))


def cases_in(parquet: bytes) -> int:
    """Number of the cases in a Parquet file of rows, of which several can be those of one case."""
    with naming_extra("a table", "tables"):
        import pyarrow.compute as pc

    return int(pc.count_distinct(arrow_of(parquet).read(["case"])["case"]).as_py())


def units_of(schema: Any) -> dict[str, str]:
    """The unit of each column of a Parquet file that has one, from the metadata of its fields."""
    units = ((field.name, (field.metadata or {}).get(b"unit")) for field in schema)
    return {name: unit.decode() for name, unit in units if unit is not None}


def beside(cases: Sequence[CaseDetail]) -> pd.DataFrame:
    """Cases as columns, by their numbers, after the units; a row for each parameter, the ending, and each result."""
    with naming_extra("side_by_side", "tables"):
        import pandas as pd

    rows = [{**case["parameters"], "ending": case["ending"], **case["results"]} for case in cases]
    table = pd.DataFrame(
        {"unit": cases[0]["units"] if cases else {}}, index=list(rows[0]) if rows else [], dtype=object
    )
    for case, row in zip(cases, rows, strict=True):
        table[case["case"]] = pd.Series(row, dtype=object)
    return table


def polars_of(parquet: bytes) -> pl.DataFrame:
    """All rows of a study as a polars table, from its Parquet file."""
    with naming_extra("a polars table", "frames"):
        import polars as pl

    return pl.read_parquet(io.BytesIO(parquet))


def grid_of(netcdf: bytes) -> xr.Dataset:
    """All rows of a study as a labelled grid, from its NetCDF file; names are those of all other tables."""
    with naming_extra("a grid", "tables"):
        import h5netcdf  # noqa: F401 - xarray uses it
        import xarray as xr

    grid = xr.load_dataset(io.BytesIO(netcdf), engine="h5netcdf")
    for variable in grid.variables.values():
        variable.encoding.pop(
            "coordinates", None
        )  # names of the file; xarray finds those of the grid when it writes it
    return grid.rename({name: variable.attrs.pop(NAME_ATTRIBUTE, name) for name, variable in grid.variables.items()})
