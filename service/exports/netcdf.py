"""Rows as a labelled grid: a NetCDF file whose dimensions are the axes, with units and meanings as attributes."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from service.catalogue import unit_of
from service.exports.inputs import description_of
from service.exports.source import machine
from service.exports.spool import spooled

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from service.exports.source import Source
    from worker.study import Study

#: The code of a case that has no row.
_NONE: Final = -1
_CASE: Final = "case"


def netcdf_pieces(source: Source) -> Iterator[bytes]:
    """The file in pieces. It is made on the disk, one result at a time, so that memory stays small."""
    return spooled(partial(_write, source))


def _write(source: Source, folder: Path) -> Path:
    import xarray as xr

    study, path = source.study, folder / "results.nc"
    rows = _Columns(source, folder / "columns")
    dims, shape = dimensions(study)
    head = xr.Dataset(coords=_coordinates(study, dims), attrs=_about(source))
    head["ending"] = (dims, rows.endings.reshape(shape), _codes("how the case ended", rows.ending_names, "flag_values"))
    head["flags"] = (dims, rows.flags.reshape(shape), _codes("what to know of the case", rows.flag_names, "flag_masks"))
    head.to_netcdf(path, engine="h5netcdf")
    for index, info in enumerate(source.infos):
        attributes = {"units": info.unit, "long_name": info.description}
        column = xr.Dataset({info.name: (dims, rows.column(index).reshape(shape), attributes)})
        column.to_netcdf(path, engine="h5netcdf", mode="a")
    return path


def dimensions(study: Study) -> tuple[tuple[str, ...], tuple[int, ...]]:
    """Names and lengths: the first path of each axis of a grid; ``case`` where axes go together."""
    if study.combine == "grid":
        return tuple(axis.paths[0] for axis in study.axes), study.shape
    return (_CASE,), (study.cases,)


def _coordinates(study: Study, dims: tuple[str, ...]) -> dict[str, Any]:
    """Values of every axis path along its dimension; a tied path is a further label of the same dimension."""
    found: dict[str, Any] = {}
    for index, axis in enumerate(study.axes):
        dim = dims[index if study.combine == "grid" else 0]
        for path in axis.paths:
            attributes = {"units": unit_of(study, path), "long_name": description_of(study, path)}
            found[path] = (dim, axis.array, attributes)
    if dims == (_CASE,):
        found[_CASE] = (_CASE, np.arange(study.cases, dtype=np.int64), {"long_name": "number of the case"})
    return found


def _about(source: Source) -> dict[str, Any]:
    study = source.study
    return {
        "title": study.name,
        **{name: str(value) for name, value in source.about.items()},
        **{name: part if isinstance(part, str) else json.dumps(part) for name, part in machine(source).items()},
    }


def _codes(meaning: str, names: list[str], kind: str) -> dict[str, Any]:
    """Attributes of a variable of codes, as the CF conventions write them."""
    codes = range(len(names)) if kind == "flag_values" else [1 << index for index in range(len(names))]
    attributes: dict[str, Any] = {"long_name": meaning}
    if names:
        attributes |= {kind: np.array(codes, dtype=np.int16), "flag_meanings": " ".join(names)}
    if kind == "flag_values":
        attributes["comment"] = f"{_NONE}: the case has not been run"
    return attributes


class _Columns:
    """The rows of a study turned into columns: results in a file, endings and flags in memory."""

    def __init__(self, source: Source, path: Path) -> None:
        self._path = path
        self._cases = cases = source.study.cases
        self.endings: NDArray[np.int16] = np.full(cases, _NONE, dtype=np.int16)
        self.flags: NDArray[np.int16] = np.zeros(cases, dtype=np.int16)
        self.ending_names: list[str] = []
        self.flag_names: list[str] = []
        file = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
        try:
            for block in source.blocks:
                self._note(block.cases, block.endings, block.flags)
                # Runs of consecutive cases, which nearly always is the whole block.
                starts = np.flatnonzero(np.diff(block.cases, prepend=block.cases[0] - 2) != 1)
                for begin, end in zip(starts, [*starts[1:], len(block)], strict=True):
                    for index in range(len(source.infos)):
                        at = 8 * (index * cases + int(block.cases[begin]))
                        os.pwrite(file, np.ascontiguousarray(block.values[begin:end, index]).tobytes(), at)
        finally:
            os.close(file)

    def _note(self, cases: NDArray[np.int64], endings: list[str], flags: list[str]) -> None:
        self.endings[cases] = [_position(self.ending_names, ending) for ending in endings]
        codes = {text: self._mask(text) for text in set(flags)}
        self.flags[cases] = [codes[text] for text in flags]

    def _mask(self, text: str) -> int:
        return sum(1 << _position(self.flag_names, name) for name in text.split(",") if name)

    def column(self, index: int) -> NDArray[np.float64]:
        """One result of all cases, NaN where there is none."""
        column = np.full(self._cases, np.nan)
        with self._path.open("rb") as file:
            file.seek(8 * index * self._cases)
            read = np.fromfile(file, dtype=np.float64, count=self._cases)
        column[: read.size] = read
        column[self.endings == _NONE] = np.nan
        return column


def _position(names: list[str], name: str) -> int:
    if name not in names:
        names.append(name)
    return names.index(name)
