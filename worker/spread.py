"""The tolerances of a study: which parameters differ from drive to drive, and by how much in each drawn drive.

The drives of a study are an axis with the path `DRIVE`: 0 is the nominal drive, 1 .. n are the drawn ones. The draws
are stored with the study, as the values of axes are, so they are the same in every process and with every version of
the libraries that made them. All values of the other axes share the same draws (common random numbers).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.packed import packed, unpacked

if TYPE_CHECKING:
    Floats = NDArray[np.float64]

#: Path of the axis of drives. It is not a parameter of any machine.
DRIVE: Final = "drive"

Change = Literal["scale", "offset", "value"]


@dataclass(frozen=True)
class Tolerance:
    """One independent deviation of a drive from the nominal one.

    Attributes
    ----------
    name : str
        Its path in the spec; with ``*`` where the parameters of all pendulums or steps share one draw.
    paths : tuple of str
        The parameters that take part; they share the draw.
    change : {"scale", "offset", "value"}
        What a draw is: a factor of the nominal value, a difference from it in SI, or the value itself in SI.
    about : dict
        The distribution for people, as plain JSON data: ``distribution``, and ``plus_minus`` as written or ``values``.
    """

    name: str
    paths: tuple[str, ...]
    change: Change
    about: Mapping[str, Any] = field(default_factory=dict)

    def applied(self, nominal: Floats | float, draws: Floats) -> Floats:
        """The value of one of its parameters in drives with those draws, SI."""
        if self.change == "scale":
            return np.asarray(nominal * draws, dtype=np.float64)
        return np.asarray(nominal + draws if self.change == "offset" else draws + 0.0, dtype=np.float64)


class Spread:
    """The tolerances of a study and the draws of its drives. Immutable.

    Parameters
    ----------
    tolerances : sequence of Tolerance
    draws : array, shape (drives, tolerances)
        Row ``k`` belongs to drive ``k + 1``; each column is what the `change` of its tolerance says.
    about : mapping
        How the draws were made, for people, as plain JSON data: ``seed``, ``draws`` (the method), ``correlations``.
    fresh : int
        How many of the last drives are fresh ones, which a search runs with its best designs only.

    Attributes
    ----------
    array : float64 array, shape (drives + fresh, tolerances), read-only
    """

    def __init__(
        self,
        tolerances: Sequence[Tolerance],
        draws: Sequence[Sequence[float]] | Floats,
        about: Mapping[str, Any] | None = None,
        fresh: int = 0,
    ) -> None:
        array = np.array(draws, dtype=np.float64)
        if array.ndim != 2 or not array.size or array.shape[1] != len(tolerances):
            raise ValueError("a spread needs a draw of each tolerance for at least one drive")
        if not 0 <= fresh < len(array):
            raise ValueError("a spread needs drives that are not fresh")
        if not np.isfinite(array).all():
            raise ValueError("every draw must be a finite number")
        paths = [path for tolerance in tolerances for path in tolerance.paths]
        if len(set(paths)) != len(paths):
            raise ValueError("a path has two tolerances")
        if not all(tolerance.change in get_args(Change) for tolerance in tolerances):
            raise ValueError(f"the change of a tolerance is one of {', '.join(get_args(Change))}")
        array.flags.writeable = False
        self.tolerances = tuple(tolerances)
        self.array = array
        self.about = dict(about or {})
        self.fresh = fresh
        self._column = {path: k for k, tolerance in enumerate(tolerances) for path in tolerance.paths}

    @property
    def drives(self) -> int:
        """Number of drawn drives; the nominal one and fresh ones are not counted."""
        return len(self.array) - self.fresh

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the tolerances."""
        return tuple(tolerance.name for tolerance in self.tolerances)

    @property
    def paths(self) -> tuple[str, ...]:
        """Every parameter with a tolerance."""
        return tuple(self._column)

    def values(self, path: str, nominal: Floats | float, drives: NDArray[Any]) -> Floats:
        """Values of one parameter, SI, shape (m,).

        Parameters
        ----------
        path : one of `paths`
        nominal : its nominal values, shape (m,), or the only one
        drives : numbers of drives, shape (m,); 0 gives the nominal value, bit for bit
        """
        column = self._column[path]
        numbers = np.asarray(drives).astype(np.int64)
        draws = self.array[np.maximum(numbers, 1) - 1, column]
        return np.where(numbers == 0, nominal, self.tolerances[column].applied(nominal, draws)) + 0.0

    def of(self, paths: Collection[str]) -> Spread | None:
        """The part that concerns some parameters; None where none of them has a tolerance."""
        kept = [k for k, one in enumerate(self.tolerances) if not set(paths).isdisjoint(one.paths)]
        tolerances = [self.tolerances[k] for k in kept]
        own = [replace(one, paths=tuple(path for path in one.paths if path in paths)) for one in tolerances]
        return Spread(own, self.array[:, kept], self.about, self.fresh) if own else None

    def columns(self, base: Mapping[str, float], columns: Mapping[str, Floats]) -> dict[str, Floats]:
        """Values of all `paths` in cases: path -> array, shape (m,), SI.

        ``columns`` has the nominal values of those that vary, and the numbers of the drives under `DRIVE`.
        """
        drives = columns[DRIVE].astype(np.int64)
        nominal: dict[str, Floats | float] = {**base, **columns}
        return {path: self.values(path, nominal[path], drives) for path in self.paths}

    def to_json(self) -> dict[str, Any]:
        """The spread as plain JSON data; `from_json` gives an equal one."""
        items = [
            {"name": one.name, "paths": list(one.paths), "change": one.change, "about": dict(one.about)}
            for one in self.tolerances
        ]
        fresh = {"fresh": self.fresh} if self.fresh else {}
        return {"items": items, "drives": self.drives, **fresh, **self.about, "values": packed(self.array.reshape(-1))}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Spread:
        """The spread that `to_json` wrote; KeyError, TypeError or ValueError when it is not one."""
        tolerances = [
            Tolerance(str(one["name"]), tuple(one["paths"]), one["change"], dict(one.get("about", {})))
            for one in data["items"]
        ]
        about = {key: value for key, value in data.items() if key not in {"items", "drives", "fresh", "values"}}
        fresh = int(data.get("fresh", 0))
        draws = np.asarray(unpacked(data["values"]), dtype=np.float64).reshape(int(data["drives"]) + fresh, -1)
        return cls(tolerances, draws, about, fresh)

    def __reduce__(self) -> tuple[type[Spread], tuple[Any, ...]]:
        return Spread, (self.tolerances, self.array, self.about, self.fresh)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Spread):
            return NotImplemented
        same = (self.tolerances, self.about, self.fresh) == (other.tolerances, other.about, other.fresh)
        return same and np.array_equal(self.array, other.array)

    def __hash__(self) -> int:
        return hash((self.paths, self.array.tobytes()))

    def __repr__(self) -> str:
        return f"Spread({self.names!r}, {self.drives} drives)"
