"""Components among which a study chooses: springs, clutches or motors with names, as the places of one axis.

An axis with the path of `Components` has the numbers of its components, 0 for the first. Each place gives all
parameters of its component, which are stored with the study: what somebody changes of a component later changes no
study.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.catalogue import Parameter
from sprag_study.sentences import Named

if TYPE_CHECKING:
    Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Components:
    """The components of one kind among which a study chooses; immutable.

    Attributes
    ----------
    path : str
        Path of the axis: the kind, such as "clutch". It is not a parameter of any machine.
    names : tuple of str
        What the components are called, in the order of their numbers.
    values : dict
        Path of a parameter in which they differ -> its value (SI) in each machine, one for each name.
    numbers : dict
        Path of a number that is no parameter of the machine, such as "clutch.price" -> its values (SI).
    units : dict
        Path of such a number -> its SI unit.

    Raises
    ------
    ValueError
        Where a list has another length, or a value is not finite.
    """

    path: str
    names: tuple[str, ...]
    values: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    numbers: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.names or self.numbers.keys() != self.units.keys():
            raise ValueError("components need a name, and each of their numbers a unit")
        for path, values in self.columns.items():
            if len(values) != len(self.names) or not all(map(math.isfinite, values)):
                raise ValueError(f"{path} needs a finite number for each component")

    def __hash__(self) -> int:
        return hash((self.path, self.names))

    @property
    def columns(self) -> dict[str, tuple[float, ...]]:
        """Every number that follows from the place on the axis, by path."""
        return {**self.values, **self.numbers}

    def along(self, path: str, places: Floats) -> Floats:
        """Values (SI) of one of the `columns` at numbers of components, shape (m,)."""
        return np.array(self.columns[path])[places.astype(np.int64)]

    def parameter(self, path: str) -> Parameter | None:
        """The number of the component, or one of its `numbers`, as a parameter; None for any other path."""
        if path == self.path:
            last = float(len(self.names) - 1)
            return Parameter(path, "", Named(self.names), 0.0, last, False, None, f"the {path} of the machine")
        if path in self.units:
            unit = self.units[path]
            return Parameter(path, "", unit, -math.inf, math.inf, False, None, path.replace(".", " "))
        return None

    def to_json(self) -> dict[str, Any]:
        """The components as plain JSON data; `from_json` gives equal ones."""
        return {
            "path": self.path,
            "names": list(self.names),
            "values": {path: list(values) for path, values in self.values.items()},
            "numbers": {path: list(values) for path, values in self.numbers.items()},
            "units": dict(self.units),
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Components:
        """The components that `to_json` wrote; KeyError, TypeError or ValueError where they are none."""

        def read(values: Mapping[str, Sequence[float]]) -> dict[str, tuple[float, ...]]:
            return {str(path): tuple(map(float, numbers)) for path, numbers in values.items()}

        return cls(
            str(data["path"]), tuple(map(str, data["names"])), read(data["values"]), read(data["numbers"]),
            dict(data["units"]),
        )  # fmt: skip
