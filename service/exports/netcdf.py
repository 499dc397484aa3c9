"""Rows as a labelled grid: a CF NetCDF file; its dimensions are the axes, units and meanings are attributes."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.sentences import Named
from sprag_study.service.exports.inputs import column_description, description_of
from sprag_study.service.exports.source import machine
from sprag_study.service.exports.spool import require_room, spooled
from sprag_study.service.formats import NAME_ATTRIBUTE
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.worker.codes import ENDING_CODES, FLAG_MASKS, PENDING, flags_mask
from sprag_study.worker.derived import blocks
from sprag_study.worker.directions import DIRECTIONS, DOWN, SWEEP, UP

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.service.exports.source import Source
    from sprag_study.worker.arrays import Floats, Ints
    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.study import Axis, Study

_CONVENTIONS: Final = "CF-1.11"
_CASE: Final = "case"
#: Level of zlib: higher ones take several times as long and save a few per cent.
_LEVEL: Final = 1
#: Bytes of results that are written at once: to open the file anew takes longer than to write a small column.
_AT_ONCE: Final = 16 * 2**20


def cf_name(name: str) -> str:
    """The name of a path or result in the file: letters, digits and underscores (CF 2.3)."""
    return name.replace(".", "_")


def netcdf_pieces(source: Source, folder: Path | None = None) -> Iterator[bytes]:
    """The file in pieces. It is built on disk, a few results at a time, to limit memory."""
    return spooled(partial(_write, source), folder)


def _write(source: Source, folder: Path) -> Path:
    import xarray as xr

    study, path = source.study, folder / "results.nc"
    rows = _Columns(source, folder / "columns")
    grid = _Grid(study)
    about = _about(source)
    require_room(folder, _most_bytes(source, grid, about))
    head = xr.Dataset(coords=grid.coordinates(), attrs=about)
    head["ending"] = grid.variable(rows.endings, _ending_attributes())
    head["flags"] = grid.variable(rows.flags, _flag_attributes())
    head.to_netcdf(path, engine="h5netcdf", unlimited_dims=())
    at_once = max(1, _AT_ONCE // (8 * max(1, study.cases)))
    for first in range(0, len(source.infos), at_once):
        columns = {}
        for index, info in enumerate(source.infos[first : first + at_once], first):
            columns[cf_name(info.name)] = column = grid.variable(*_variable(info, rows.column(index)))
            # The coordinates are in the file already; xarray names them only for variables written together with them.
            if grid.labels:
                column.attrs["coordinates"] = " ".join(grid.labels)
        xr.Dataset(columns).to_netcdf(path, engine="h5netcdf", mode="a")
    return path


def _most_bytes(source: Source, grid: _Grid, about: dict[str, Any]) -> int:
    """More bytes than the file will have: numbers that cannot be compressed, and what describes each variable."""
    variables = len(source.infos) + len(source.study.axis_paths) + len(grid.labels) + 3
    return (
        10 * source.study.cases * variables + 2**14 * variables + 2 * sum(len(str(a)) for a in about.values()) + 2**20
    )


class _Grid:
    """The positions of a study's cases in the file.

    Attributes
    ----------
    dims : names in the file of the dimensions: the first path of each axis of a grid; ``case`` where axes are zipped
    shape : their lengths
    labels : coordinates that are not dimensions: the case number in a grid, further paths of tied axes, and paths
        that are of a component, drawn or derived
    """

    def __init__(self, study: Study) -> None:
        self._study = study
        self._together = study.combine != "grid"
        self.dims = (_CASE,) if self._together else tuple(cf_name(axis.paths[0]) for axis in study.axes)
        self.shape = study.shape or ((1,) if self._together else ())
        self._orders = [slice(None)] if self._together else [_order(axis) for axis in study.axes]
        paths = study.axis_paths if self._together else [path for axis in study.axes for path in axis.paths[1:]]
        drawn = () if study.spread is None else study.spread.paths
        others = [path for path in dict.fromkeys((*study.component_paths, *drawn)) if path not in study.axis_paths]
        self._drawn = [path for path in others if study.varied(path) is not None]
        self._of_cases = [*(path for path in others if path not in self._drawn), *study.derive]
        self.labels = [*([] if self._together else [_CASE]), *map(cf_name, (*paths, *self._drawn, *self._of_cases))]

    def place(self, column: NDArray[Any]) -> NDArray[Any]:
        """A column in the order of cases as an array over the dimensions."""
        array = column.reshape(self.shape)
        for dimension, order in enumerate(self._orders):
            array = array[(slice(None),) * dimension + (order,)]
        return array

    def variable(self, column: NDArray[Any], attributes: dict[str, Any]) -> Any:
        """A column as a compressed variable over the dimensions."""
        import xarray as xr

        encoding: dict[str, Any] = {"zlib": True, "complevel": _LEVEL, "shuffle": True} if self.dims else {}
        return xr.Variable(self.dims, self.place(column), attributes, encoding)

    def coordinates(self) -> dict[str, Any]:
        """Values of every axis path along its dimension, drawn and derived ones, and the number of every case.

        Those of an axis are nominal.
        """
        import xarray as xr

        study = self._study
        unfilled: dict[str, Any] = {"_FillValue": None}
        found: dict[str, Any] = {}
        for index, axis in enumerate(study.axes):
            dimension, order = (0, slice(None)) if self._together else (index, self._orders[index])
            for path in axis.paths:
                attributes = _attributes(path, unit_of(study, path), description_of(study, path))
                if path == SWEEP:
                    attributes |= {"flag_values": [float(UP), float(DOWN)], "flag_meanings": " ".join(DIRECTIONS)}
                if isinstance(unit := unit_of(study, path), Named):
                    meanings = " ".join("_".join(name.split()) for name in unit.names)
                    attributes |= {"flag_values": np.arange(float(len(unit.names))), "flag_meanings": meanings}
                found[cf_name(path)] = xr.Variable(self.dims[dimension], axis.array[order], attributes, unfilled)
        for path in self._drawn:
            position, values = study.varied(path) or (0, np.empty(0))
            dimension, order = (0, slice(None)) if self._together else (position, self._orders[position])
            attributes = _attributes(path, unit_of(study, path), description_of(study, path))
            found[cf_name(path)] = xr.Variable(self.dims[dimension], values[order], attributes, unfilled)
        for path, column in self._derived().items():
            attributes = _attributes(path, unit_of(study, path), column_description(study, path))
            found[cf_name(path)] = self.variable(column, attributes)
        numbers = self.variable(
            np.arange(study.cases, dtype=np.int64), {"units": "1", "long_name": "number of the case"}
        )
        return {**found, _CASE: numbers}

    def _derived(self) -> dict[str, Floats]:
        """The parameters of every case that follow from several axes, or from others."""
        parts = [self._study.columns(cases) for cases in blocks(self._study)] if self._of_cases else []
        return {path: np.concatenate([part[path] for part in parts]) for path in self._of_cases}


def _order(axis: Axis) -> Any:
    """Indices that sort the values of an axis as CF coordinates, which must rise or fall monotonically."""
    steps = np.diff(axis.array)
    return slice(None) if (steps > 0).all() or (steps < 0).all() else np.argsort(axis.array)


def _about(source: Source) -> dict[str, Any]:
    study = source.study
    return {
        "Conventions": _CONVENTIONS,
        "title": study.name or "parameter study",
        "history": f"written by Sprag {version('sprag-study')}",
        **{name: part if isinstance(part, str) else json.dumps(part) for name, part in source.about.items()},
        **{name: part if isinstance(part, str) else json.dumps(part) for name, part in machine(source).items()},
    }


def _attributes(name: str, unit: str, meaning: str) -> dict[str, Any]:
    """The attributes of a number, among them its name outside of the file."""
    # HDF5 takes no subclass of str, which the unit of a share is.
    return {NAME_ATTRIBUTE: name, "units": str(unit), "long_name": meaning or name}


def _ending_attributes() -> dict[str, Any]:
    return {
        "long_name": "how the case ended",
        "flag_values": np.array(list(ENDING_CODES.values()), dtype=np.int16),
        "flag_meanings": " ".join(ENDING_CODES),
    }


def _flag_attributes() -> dict[str, Any]:
    return {
        "long_name": "flags of the case",
        "flag_masks": np.array(list(FLAG_MASKS.values()), dtype=np.int32),
        "flag_meanings": " ".join(FLAG_MASKS),
    }


def _variable(info: ResultInfo, column: Floats) -> tuple[NDArray[Any], dict[str, Any]]:
    """Values and attributes of a result; a category becomes codes, the first of which means none."""
    if info.kind != "category":
        return column, _attributes(info.name, info.unit, info.description)
    attributes = {
        NAME_ATTRIBUTE: info.name,
        "long_name": info.description,
        "flag_values": np.arange(len(info.categories), dtype=np.int8),
        "flag_meanings": " ".join(info.categories),
    }
    return np.where(np.isnan(column), 0.0, column).astype(np.int8), attributes


def _write_at(file: int, content: bytes, at: int) -> None:
    """Write all of the content; the system may write a part only, where the disk is nearly full."""
    left = memoryview(content)
    while left:
        written = os.pwrite(file, left, at)
        left, at = left[written:], at + written


class _Columns:
    """The rows of a study turned into columns: results in a file, endings and flags in memory."""

    def __init__(self, source: Source, path: Path) -> None:
        self._path = path
        self._cases = cases = source.study.cases
        self.endings: NDArray[np.int16] = np.full(cases, ENDING_CODES[PENDING], dtype=np.int16)
        self.flags: NDArray[np.int32] = np.zeros(cases, dtype=np.int32)
        file = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
        try:
            # A grid has one value for each case: that of its first row.
            for block in (block.first_rows() for block in source.blocks):
                self._note(block.cases, block.endings, block.flags)
                # Runs of consecutive cases; nearly always one run is the whole block.
                starts = np.flatnonzero(np.diff(block.cases, prepend=block.cases[0] - 2) != 1)
                for begin, end in zip(starts, [*starts[1:], len(block)], strict=True):
                    for index in range(len(source.infos)):
                        at = 8 * (index * cases + int(block.cases[begin]))
                        _write_at(file, np.ascontiguousarray(block.values[begin:end, index]).tobytes(), at)
        finally:
            os.close(file)

    def _note(self, cases: Ints, endings: list[str], flags: list[str]) -> None:
        self.endings[cases] = [ENDING_CODES[ending] for ending in endings]
        masks = {text: flags_mask(text) for text in set(flags)}
        self.flags[cases] = [masks[text] for text in flags]

    def column(self, index: int) -> Floats:
        """One result of all cases, NaN where there is none."""
        column = np.full(self._cases, np.nan)
        with self._path.open("rb") as file:
            file.seek(8 * index * self._cases)
            read = np.fromfile(file, dtype=np.float64, count=self._cases)
        column[: read.size] = read
        column[self.endings == ENDING_CODES[PENDING]] = np.nan
        return column
