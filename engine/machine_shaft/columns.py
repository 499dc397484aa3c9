"""The numbers of a block of cases, by path."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine.machine_shaft.parameters import parameters
from sprag_study.engine.machine_shaft.spec import MachineSpec

Floats = NDArray[np.float64]


class Columns:
    """Numbers of a block of cases.

    Attributes
    ----------
    cases : int
    values : dict
        Every parameter of the structure by path: shape (cases, 1, 1), or (1, 1, 1) where all cases share it.
    """

    def __init__(self, values: dict[str, Floats], cases: int) -> None:
        self.values, self.cases = values, cases

    @classmethod
    def of(cls, spec: MachineSpec, columns: Mapping[str, ArrayLike], cases: int) -> "Columns":
        """Columns with the defaults of the catalogue; ValueError where one is missing or unknown."""
        known = {parameter.path: parameter.default for parameter in parameters(spec)}
        unknown = sorted(set(columns) - set(known))
        if unknown:
            raise ValueError(f"unknown parameters of this machine: {', '.join(unknown)}")
        values = {}
        for path, default in known.items():
            given = columns.get(path, default)
            if given is None:
                raise ValueError(f"{path} is required")
            array = np.asarray(given, dtype=np.float64)
            if array.shape not in {(), (cases,)}:
                raise ValueError(f"{path} has the shape {array.shape}, not () or ({cases},)")
            values[path] = array.reshape(-1, 1, 1)
        return cls(values, cases)

    def take(self, rows: NDArray[np.int64] | slice) -> "Columns":
        """The same for some of the cases."""
        values = {path: value[rows] if len(value) == self.cases else value for path, value in self.values.items()}
        count = len(range(self.cases)[rows]) if isinstance(rows, slice) else len(rows)
        return Columns(values, count)

    def under(self, prefix: str) -> dict[str, Floats]:
        """Values of the paths that begin with ``prefix``, without it."""
        return {path[len(prefix) :]: value for path, value in self.values.items() if path.startswith(prefix)}

    def row(self, path: str) -> Floats:
        """One parameter, shape (cases,)."""
        return np.broadcast_to(self.values[path][:, 0, 0], (self.cases,))
