"""A study in SI numbers: base parameters, axes, and the numbering of its cases. No units and no physics here."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, cast, get_args

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.axis import SAME_VALUE, Axis
from sprag_study.worker.directions import DOWN, SWEEP, UP
from sprag_study.worker.limits import MAX_AXES, MAX_AXIS_VALUES, MAX_CASES, MAX_COLUMNS
from sprag_study.worker.models.components import Components
from sprag_study.worker.models.formulas import evaluate
from sprag_study.worker.models.quantities import Quantity
from sprag_study.worker.packed import packed, unpacked
from sprag_study.worker.spread import DRIVE, Spread, Tolerance

__all__ = ["SAME_VALUE", "Axis", "Combine", "Study"]

Combine = Literal["grid", "zip"]


@dataclass(frozen=True)
class Study:
    """One study: everything that determines its results, and its name.

    Attributes
    ----------
    model : str
        Name of the model, for instance "vibration-drive".
    name : str
        The user's name for it; not part of `physics_hash`.
    base : dict
        Flat path in a spec -> SI number, every parameter, defaults filled in.
    run : dict
        ``{"duration": [60.0, "periods"], "window": [[40.0, "periods"], [60.0, "periods"]] or None, "tolerance": 1e-9,
        "reset": "contact"}``; times in "periods" or "s". Empty for a model without a run.
    axes : tuple of Axis
    structure : dict or None
        The non-numeric part of the machine as plain JSON data, where the model has one (a machine shaft's mechanism,
        tables and formulas); immutable.
    plan : dict or None
        How a study that chooses its own cases does so, as plain JSON data (`sprag_study.worker.planning`); immutable.
        Its axes are zipped and have the cases of the rounds so far.
    derive : dict
        Path -> formula of other parameters in SI numbers (`sprag_study.worker.models.formulas`), sorted by path;
        immutable. No axis varies such a path, and its value in `base` is that of the formula there.
    combine : "grid" or "zip"
        Grid: every combination, the first axis varies slowest. Zip: the axes side by side, all of one length.
    spread : Spread or None
        Tolerances and the draws of the drives. The axis with the path `DRIVE`, the last one, then says which drive a
        case belongs to, and the base and the other axes hold nominal values.
    sweep : str or None
        A path of the axis along which each case starts from the settled motion of its neighbour
        (`sprag_study.worker.sweeps`). The axis with the path `SWEEP`, the last one, then gives the direction of each
        case.
    quantities : tuple of Quantity
        Formulas over parameters and results that it has beside the results of its model. They change no row.
    components : tuple of Components
        Springs, clutches or motors among which it chooses, of each kind at most once. An axis with their path has
        their numbers.

    Raises
    ------
    ValueError
        When the parts are inconsistent (a repeated path, unequal lengths) or exceed `sprag_study.worker.limits`.
    """

    model: str
    name: str
    base: dict[str, float]
    run: dict[str, Any]
    axes: tuple[Axis, ...] = ()
    combine: Combine = "grid"
    structure: dict[str, Any] | None = None
    plan: dict[str, Any] | None = None
    derive: dict[str, str] = field(default_factory=dict)
    spread: Spread | None = None
    sweep: str | None = None
    quantities: tuple[Quantity, ...] = ()
    components: tuple[Components, ...] = ()

    def __post_init__(self) -> None:
        if self.combine not in get_args(Combine):
            raise ValueError(f"combine must be 'grid' or 'zip', not {self.combine!r}")
        if self.plan is not None and self.combine != "zip":
            raise ValueError("a study with a plan lists its cases (zip)")
        paths = [path for axis in self.axes for path in axis.paths]
        if len(set(paths)) != len(paths):
            raise ValueError("a path is on two axes")
        if not self.derive.keys() <= self.base.keys() - set(paths):
            raise ValueError("a derived path is on an axis, or not in the base")
        if self.combine == "zip" and len({len(axis) for axis in self.axes}) > 1:
            raise ValueError("axes that are zipped must have equal lengths")
        self._check_spread(paths)
        _check_sweep(self, paths)
        _check_components(self, paths)
        own = (self.spread is not None) + (self.sweep is not None)
        most = (MAX_AXES if self.combine == "grid" else MAX_COLUMNS) + own
        if len(self.axes) > most or sum(map(len, self.axes)) > MAX_AXIS_VALUES or self.cases > MAX_CASES:
            raise ValueError("the study is larger than the limits allow")

    def _check_spread(self, paths: list[str]) -> None:
        if self.spread is None:
            if DRIVE in paths:
                raise ValueError("an axis of drives needs tolerances")
            return
        if not self.axes or self.axes[-1].paths != (DRIVE,):
            raise ValueError("the last axis of a study with tolerances is that of its drives")
        numbers = self.axes[-1].array
        if numbers.min() < 0 or numbers.max() > len(self.spread.array) or (numbers != np.floor(numbers)).any():
            raise ValueError("a drive has no draws")
        if not set(self.spread.paths) <= {*self.base, *paths} - {DRIVE, *self.derive}:
            raise ValueError("a tolerance is of a derived or an unknown path")

    @property
    def drives(self) -> int:
        """Number of drawn drives; 0 without tolerances."""
        return 0 if self.spread is None else self.spread.drives

    @property
    def tolerances(self) -> tuple[Tolerance, ...]:
        """How its drives differ from the nominal one; none without a spread."""
        return () if self.spread is None else self.spread.tolerances

    @property
    def kind(self) -> str | None:
        """By which planner it chooses its own cases (`sprag_study.worker.planning`); None where its axes are given."""
        return None if self.plan is None else str(self.plan["kind"])

    @property
    def batched(self) -> bool:
        """Whether every place of its axes has a case of each drive."""
        return self.spread is not None and self.plan is None

    @property
    def shape(self) -> tuple[int, ...]:
        """Lengths of the dimensions in which cases are numbered: one per axis of a grid, a single one for a zip."""
        if not self.axes:
            return ()
        return tuple(map(len, self.axes)) if self.combine == "grid" else (len(self.axes[0]),)

    @property
    def cases(self) -> int:
        """Number of cases; 1 without axes."""
        return math.prod(self.shape)

    @property
    def axis_paths(self) -> tuple[str, ...]:
        """Every path on an axis, in the order of the axes."""
        return tuple(path for axis in self.axes for path in axis.paths)

    @property
    def column_paths(self) -> tuple[str, ...]:
        """Every path that `columns` gives: those on axes, those with tolerances, then the derived ones."""
        drawn = () if self.spread is None else self.spread.paths
        return tuple(dict.fromkeys((*self.axis_paths, *self.component_paths, *drawn, *self.derive)))

    @property
    def component_paths(self) -> tuple[str, ...]:
        """Every path whose value follows from the component on an axis."""
        return tuple(path for one in self.components if self.axis_of(one.path) is not None for path in one.columns)

    @property
    def beside(self) -> frozenset[str]:
        """The `column_paths` that are not parameters of its machine."""
        of_components = (path for one in self.components for path in (one.path, *one.numbers))
        return frozenset((DRIVE, SWEEP, *of_components))

    @property
    def apart(self) -> frozenset[str]:
        """The `column_paths` that say nothing about what a case is: equal cases may differ in them."""
        return self.beside - {SWEEP}

    def components_of(self, path: str) -> Components | None:
        """The components from which the value of ``path`` follows; None where it follows from none."""
        return next(
            (one for one in self.components if path in one.columns and self.axis_of(one.path) is not None), None
        )

    def axis_of(self, path: str) -> int | None:
        """Position of the axis that varies ``path``; None when it does not vary."""
        return next((i for i, axis in enumerate(self.axes) if path in axis.paths), None)

    def axis_with(self, path: str) -> Axis:
        """The axis that varies ``path``; raises KeyError when it does not vary."""
        position = self.axis_of(path)
        if position is None:
            raise KeyError(path)
        return self.axes[position]

    def indices(self, cases: Sequence[int] | range | NDArray[np.integer[Any]]) -> tuple[NDArray[np.int64], ...]:
        """Position on each axis of the given cases.

        Parameters
        ----------
        cases : case numbers, 0 .. `cases` - 1, shape (m,)

        Returns
        -------
        tuple of int64 arrays, shape (m,), one for each axis

        Raises
        ------
        IndexError
            When a case number does not exist.
        """
        if isinstance(cases, range):
            numbers = np.arange(cases.start, cases.stop, cases.step, dtype=np.int64)
        else:
            numbers = np.asarray(cases, dtype=np.int64).reshape(-1)
        if numbers.size and (numbers.min() < 0 or numbers.max() >= self.cases):
            raise IndexError(f"the cases of this study are 0 .. {self.cases - 1}")
        if self.combine == "zip":
            return (numbers,) * len(self.axes)
        found: list[NDArray[np.int64]] = []
        for axis in reversed(self.axes):
            numbers, index = np.divmod(numbers, len(axis))
            found.append(index)
        return tuple(reversed(found))

    def columns(self, cases: Sequence[int] | range | NDArray[np.integer[Any]]) -> dict[str, NDArray[np.float64]]:
        """Values of the `column_paths` in the given cases: path -> array of shape (m,), SI.

        Constant parameters are not included; the caller merges the columns over `base`. A parameter with a tolerance
        has the value of the case's drive. Raises IndexError as `indices` does.
        """
        found: dict[str, NDArray[np.float64]] = {}
        for axis, index in zip(self.axes, self.indices(cases), strict=True):
            column = axis.array[index]
            found.update(dict.fromkeys(axis.paths, column))
        for one in self.components:
            if one.path in found:
                found |= {path: one.along(path, found[one.path]) for path in one.columns}
        if self.spread is not None:
            found |= self.spread.columns(self.base, found)
        return found | evaluate(self.derive, self.base, found, len(cases)) if self.derive else found

    def case_parameters(self, case: int) -> dict[str, float]:
        """Values (SI) of the `column_paths` in one case; IndexError when there is no such case."""
        return {path: float(column[0]) for path, column in self.columns([case]).items()}

    def case_number(self, indices: Sequence[int]) -> int:
        """Number of the case at one position for each dimension of `shape`; IndexError outside."""
        if len(indices) != len(self.shape):
            raise IndexError(f"{len(self.shape)} positions are needed, not {len(indices)}")
        number = 0
        for index, length in zip(indices, self.shape, strict=True):
            if not 0 <= index < length:
                raise IndexError(f"position {index} is outside 0 .. {length - 1}")
            number = number * length + index
        return number

    def cases_at(self, fixed: Mapping[str, float]) -> NDArray[np.int64]:
        """Numbers of the cases in which every path in ``fixed`` has the given value (SI, within `SAME_VALUE`).

        A path that does not vary matches when its base value does, and one with a tolerance by its nominal value. Only
        the axes of a zip are scanned, and the cases that match otherwise for a path that is derived or of a component.

        Returns
        -------
        int64 array, ascending; empty when no case matches

        Raises
        ------
        KeyError
            When a path is neither on an axis nor in the base.
        """
        nothing: NDArray[np.int64] = np.empty(0, dtype=np.int64)
        follows = {*self.derive, *self.component_paths}
        derived = {path: value for path, value in fixed.items() if path in follows}
        if derived:
            cases = self.cases_at({path: value for path, value in fixed.items() if path not in derived})
            columns = self.columns(cases)
            return cases[np.all([_same(columns[path], value) for path, value in derived.items()], axis=0)]
        positions: dict[int, int] = {}
        for path, value in fixed.items():
            at = self.axis_of(path)
            if at is None:
                if not math.isclose(self.base[path], value, rel_tol=SAME_VALUE):
                    return nothing
                continue
            index = self.axes[at].index_of(value)
            if index is None or positions.setdefault(at, index) != index:
                return nothing
        if self.combine == "zip":
            return self._zipped_at(positions)
        numbers = np.zeros(1, dtype=np.int64)
        for at, axis in enumerate(self.axes):
            chosen = np.array([positions[at]]) if at in positions else np.arange(len(axis), dtype=np.int64)
            numbers = (numbers[:, None] * len(axis) + chosen[None, :]).reshape(-1)
        return numbers

    def _zipped_at(self, positions: Mapping[int, int]) -> NDArray[np.int64]:
        match = np.ones(self.cases, dtype=np.bool_)
        for at, index in positions.items():
            # A zipped axis may repeat a value, so a single position does not identify the cases.
            match &= self.axes[at].array == self.axes[at].array[index]
        return np.flatnonzero(match).astype(np.int64)

    def values_with(self, cases: range) -> Iterator[dict[str, float]]:
        """The parameters of consecutive cases that `columns` gives, one dictionary (path -> SI number) at a time."""
        columns = {path: column.tolist() for path, column in self.columns(cases).items()}
        for row in range(len(cases)):
            yield {path: column[row] for path, column in columns.items()}

    def varied(self, path: str) -> tuple[int, NDArray[np.float64]] | None:
        """The one axis on which the value of a parameter depends: its position, and the value (SI) at each place on it.

        None where it depends on no axis, is derived, or depends on both its own axis and the drive.
        """
        one = self.components_of(path)
        at = self.axis_of(path if one is None else one.path)
        values = None if at is None else self.axes[at].array if one is None else one.along(path, self.axes[at].array)
        if self.spread is None or path not in self.spread.paths:
            return None if at is None or values is None else (at, values)
        if at is not None and self.combine == "grid":
            return None
        nominal = self.base[path] if values is None else values
        return len(self.axes) - 1, self.spread.values(path, nominal, self.axes[-1].array)

    def points(self, cases: range) -> NDArray[np.float64]:
        """The values on every axis of consecutive cases, SI: shape (cases, axes)."""
        indices = self.indices(cases)
        columns = [axis.array[index] for axis, index in zip(self.axes, indices, strict=True)]
        return np.stack(columns, axis=1) if columns else np.empty((len(cases), 0))

    def with_points(self, points: NDArray[np.float64]) -> Study:
        """The study with further cases at its end, given as `points` gives them; its axes must be zipped."""
        if self.combine != "zip":
            raise ValueError("only a study that lists its cases (zip) takes further ones")
        axes = tuple(
            Axis(axis.paths, np.concatenate([axis.array, column]))
            for axis, column in zip(self.axes, points.T, strict=True)
        )
        return replace(self, axes=axes)

    def to_json(self) -> dict[str, Any]:
        """The study as plain JSON data; `from_json` gives an equal study."""
        axes = [{"paths": list(axis.paths), "values": axis.array.tolist()} for axis in self.axes]
        return self._without_axes() | {"axes": axes}

    def _without_axes(self) -> dict[str, Any]:
        return {
            "model": self.model,
            "name": self.name,
            "base": dict(self.base),
            "run": dict(self.run),
            "axes": [],
            "combine": self.combine,
            # Omitted where there is none, so that older studies and their hashes stay unchanged.
            **({} if self.structure is None else {"structure": self.structure}),
            **({} if self.plan is None else {"plan": self.plan}),
            **({"derive": dict(self.derive)} if self.derive else {}),
            **({} if self.spread is None else {"spread": self.spread.to_json()}),
            **({} if self.sweep is None else {"sweep": self.sweep}),
            **({"quantities": {one.name: one.to_json() for one in self.quantities}} if self.quantities else {}),
            **({"components": [one.to_json() for one in self.components]} if self.components else {}),
        }

    def to_text(self) -> str:
        """The study as stored JSON text; long axes are packed, so that they are read quickly."""
        axes = [{"paths": list(axis.paths), "values": packed(axis.array)} for axis in self.axes]
        return json.dumps(self._without_axes() | {"axes": axes}, allow_nan=False)

    @classmethod
    def from_text(cls, text: str) -> Study:
        """The study that `to_text` wrote; KeyError, TypeError or ValueError when it is not one."""
        return cls.from_json(json.loads(text))

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Study:
        """The study that `to_json` or `to_text` wrote; KeyError, TypeError or ValueError when it is not one."""
        return cls(
            model=str(data["model"]),
            name=str(data["name"]),
            base={str(path): float(value) for path, value in data["base"].items()},
            run=dict(data["run"]),
            axes=tuple(Axis(tuple(axis["paths"]), unpacked(axis["values"])) for axis in data["axes"]),
            combine=cast("Combine", data["combine"]),
            structure=data.get("structure"),
            plan=data.get("plan"),
            derive=dict(data.get("derive", {})),
            spread=Spread.from_json(data["spread"]) if data.get("spread") else None,
            sweep=data.get("sweep"),
            quantities=tuple(Quantity.from_json(*item) for item in data.get("quantities", {}).items()),
            components=tuple(map(Components.from_json, data.get("components", ()))),
        )

    def physics_hash(self, engine_version: str) -> str:
        """SHA-256 (hexadecimal) of what determines the results: the study without its name, and the engine's
        version.
        """
        physics = {key: value for key, value in self.to_json().items() if key != "name"}
        text = json.dumps(
            {"engine": engine_version, **physics},
            sort_keys=True,
            separators=(",", ":"),
            ensure_ascii=True,
            allow_nan=False,
        )
        return hashlib.sha256(text.encode("ascii")).hexdigest()


def _same(column: NDArray[np.float64], value: float) -> NDArray[np.bool_]:
    return np.asarray(np.isclose(column, value, rtol=SAME_VALUE, atol=0.0))


def _check_sweep(study: Study, paths: Sequence[str]) -> None:
    """Raise ValueError where a study that is swept lacks an axis, or another one has directions.

    ``paths`` are those of all axes.
    """
    if study.sweep is None:
        if SWEEP in paths:
            raise ValueError("an axis of directions needs a swept axis")
        return
    if not study.axes or study.axes[-1].paths != (SWEEP,):
        raise ValueError("the last axis of a swept study is that of its directions")
    if study.sweep == SWEEP or study.sweep not in paths:
        raise ValueError("the swept path must be on an axis")
    if not np.isin(study.axes[-1].array, (UP, DOWN)).all():
        raise ValueError("a direction is 0 (up) or 1 (down)")


def _check_components(study: Study, paths: Sequence[str]) -> None:
    """Raise ValueError where components have no axis of their own, or a number that they have not.

    ``paths`` are those of all axes. Parts of a study (`sprag_study.worker.derived.involved`) may lack the axis.
    """
    every = [path for one in study.components for path in (one.path, *one.columns)]
    if len(set(every)) < len(every) or not set(study.component_paths).isdisjoint((*paths, *study.derive)):
        raise ValueError("a parameter of components is on an axis, derived, or of two kinds of components")
    for one in study.components:
        axis = next((axis for axis in study.axes if one.path in axis.paths), None)
        if axis is not None and (axis.array != np.floor(axis.array)).any():
            raise ValueError("a component has no number")
        if axis is not None and not 0 <= axis.array.min() <= axis.array.max() < len(one.names):
            raise ValueError("there is no component of that number")


def without_drives(study: Study) -> Study:
    """The study of the nominal drive alone, in the order of ``study``; itself without tolerances."""
    if study.spread is None:
        return study
    *places, drives = study.axes
    if study.combine == "zip":
        nominal = drives.array == 0.0
        places = [type(axis)(axis.paths, axis.array[nominal]) for axis in places]
    return replace(study, axes=tuple(places), spread=None)
