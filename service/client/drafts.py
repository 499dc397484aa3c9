"""Specs written in Python, step by step: a machine, what varies, what is wanted of it.

The classes of the models, `sprag_study.service.client.machines`, are made of the descriptions of their specs.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any, ClassVar, Final, Self, SupportsFloat, TypeAlias

from sprag_study.service.client.errors import ArgumentError
from sprag_study.service.client.queries import spec_of, without_cases
from sprag_study.service.client.varied import paths_of, without

if TYPE_CHECKING:
    from os import PathLike

    from sprag_study.service.client.queries import Spec

#: A number in SI, of any library, or a text or an object with its unit.
Quantity: TypeAlias = SupportsFloat | str
#: What belongs to paths: a mapping from each to it, or the objects of a spec.
Entries: TypeAlias = Mapping[str, Any] | Sequence[Mapping[str, Any]]
#: Results: one, several, conditions such as "torque.max <= 3 N*m", or a mapping of each to "min", "max" or its error.
Results: TypeAlias = str | Mapping[str, Any] | Sequence[str | Mapping[str, Any]]

_CONDITION: Final = re.compile(r"([^\s<>=]+)\s*(<=|>=|=)\s*(.+)")
_RELATIONS: Final = {"<=": "at_most", ">=": "at_least", "=": "is"}


class Draft(Mapping[str, Any]):
    """A spec, for `run` and `Client.submit`. Each method gives a new one, and leaves this one as it is.

    Parameters are named by their paths, such as "shaft.load" or, as keywords, ``shaft__load``, or by the last part
    of it, ``load``, where the machine has only one of that name.
    """

    _model: ClassVar[str]
    #: Paths of the parameters of the model; `*` stands for the numbers of a list.
    _parameters: ClassVar[Sequence[str]]
    _spec: dict[str, Any]

    def __init__(self, **spec: Any) -> None:
        self._spec = {"sprag": 1, "model": self._model, **known(**spec)}

    @classmethod
    def of(cls, spec: Spec | str | PathLike[str]) -> Self:
        """The draft that a spec, a file with one, or the name of a study that comes with Sprag begins.

        Raises ArgumentError for a spec of another model, SpecFileError for a file that cannot be read.
        """
        given = dict(spec_of(spec))
        if given.get("model") != cls._model:
            raise ArgumentError("spec", given.get("model"), f"a spec of the model {cls._model!r}")
        return cls._begun(given)

    @classmethod
    def _begun(cls, spec: dict[str, Any]) -> Self:
        draft = cls.__new__(cls)
        draft._spec = spec
        return draft

    def _with(self, **fields: Any) -> Self:
        return self._begun({**self._spec, **known(**fields)})

    def _choosing(self, **kind: Any) -> Self:
        """A study that chooses its own cases, in place of those that it had."""
        return self._begun({**without_cases(self._spec), **kind})

    def __getitem__(self, field: str) -> Any:
        return self._spec[field]

    def __iter__(self) -> Iterator[str]:
        return iter(self._spec)

    def __len__(self) -> int:
        return len(self._spec)

    def __repr__(self) -> str:
        varied = [path for axis in self._axes() for path in paths_of(axis)]
        parts = [repr(self["name"])] if "name" in self else []
        parts += [f"varies {', '.join(varied)}"] if varied else []
        parts += [kind for kind in ("refine", "goal", "calibrate", "starts", "tolerances") if kind in self]
        return f"{type(self).__name__}({'; '.join(parts)})"

    def vary(self, values: Mapping[str, Any] | None = None, /, **named: Any) -> Self:
        """Let parameters vary; the cases are the combinations of all that vary.

        Parameters
        ----------
        values : mapping, optional
            The values of each parameter by its path: a list, an array, a column, a text such as "20 to 35 Hz step 5",
            or a mapping of the spec such as ``{"adaptive": ["0 N*m", "2 N*m"]}``.
        named
            The same by name, such as ``load=np.linspace(0.0, 1.0, 11)``.

        Raises
        ------
        ArgumentError
            For a name that no parameter has, or several.
        """
        draft = self
        for name, value in {**(values or {}), **named}.items():
            path = self.path(name)
            axis = {"path": path, **(value if isinstance(value, Mapping) else {"values": value})}
            draft = draft._with(axes=[*without(draft._axes(), path), axis])
        return draft

    def hold(self, values: Mapping[str, Quantity] | None = None, /, **named: Quantity) -> Self:
        """Give parameters one value each, which no longer vary then; ArgumentError as for `vary`."""
        draft = self
        for name, value in {**(values or {}), **named}.items():
            path = self.path(name)
            base = _put(draft._spec["base"], path.split("."), value)
            axes = without(draft._axes(), path)
            draft = self._begun({**draft._spec, "base": base, "axes": axes})
            if not axes:  # which some kinds of studies must not have
                del draft._spec["axes"]
        return draft

    def path(self, name: str) -> str:
        """The path of a parameter; ArgumentError for a name that no parameter of the machine has, or several.

        A whole path, with its points, is taken as it is: what reads the spec refuses one that the model lacks.
        """
        text = name.replace("__", ".")
        if "." in text:
            return text
        known = [path for pattern in self._parameters for path in _expanded(self._spec["base"], pattern.split("."))]
        fits = [path for path in known if path.rpartition(".")[2] == text]
        if len(fits) == 1:
            return fits[0]
        if fits:
            raise ArgumentError(name, name, f"one of the paths {', '.join(fits)}")
        near = get_close_matches(text, {path.rpartition(".")[2] for path in known})
        raise ArgumentError(name, name, f"a parameter, such as {', '.join(near or known[:5])}")

    def _axes(self) -> list[Any]:
        axes: list[Any] = self._spec.get("axes", [])
        return axes

    def _entries(self, entries: Entries | None, alone: str) -> list[dict[str, Any]] | None:
        """The objects that belong to paths: of a mapping, in which a pair is a range and another value ``alone``."""
        if entries is None or not isinstance(entries, Mapping):
            return None if entries is None else [dict(entry) for entry in entries]
        made = []
        for name, value in entries.items():
            ends = isinstance(value, tuple) and len(value) == 2
            pair = {"from": value[0], "to": value[1]} if ends else {alone: value}
            made.append({"path": self.path(name), **(value if isinstance(value, Mapping) else pair)})
        return made


def known(**fields: Any) -> dict[str, Any]:
    """The fields that are given."""
    return {name: value for name, value in fields.items() if value is not None}


def results_of(results: Results | None) -> list[Any] | None:
    """The objects of a spec about results."""
    if results is None:
        return None
    if isinstance(results, Mapping):
        return [_result(name, value) for name, value in results.items()]
    listed = [results] if isinstance(results, str) else results
    return [_condition(item) if isinstance(item, str) else item for item in listed]


def refined_results(results: Results) -> list[Any]:
    """The items of a spec about results that are refined: names, and objects of those with an error of their own.

    A mapping has the error of each result, None for the one of all.
    """
    if isinstance(results, Mapping):
        return [name if error is None else {"result": name, "error": error} for name, error in results.items()]
    return [results] if isinstance(results, str) else list(results)


def sensors_of(sensors: Results | None) -> list[Any] | None:
    """The objects of a spec about sensors.

    A mapping has the gain and the offset of each result, in which two values in parentheses are the ends of a range.
    """
    if sensors is None:
        return None
    if isinstance(sensors, str):
        raise ArgumentError("sensors", sensors, "a mapping such as {'torque.mean': {'gain': 1.02}}")
    if not isinstance(sensors, Mapping):
        return list(sensors)
    listed = []
    for name, factors in sensors.items():
        if not isinstance(factors, Mapping):
            raise ArgumentError(name, factors, "a mapping such as {'gain': 1.02, 'offset': ('-1 N*m', '1 N*m')}")
        ends = {key: {"from": value[0], "to": value[1]} for key, value in factors.items()
                if isinstance(value, tuple) and len(value) == 2}  # fmt: skip
        listed.append({"result": name, **factors, **ends})
    return listed


def _result(name: str, wanted: Any) -> dict[str, Any]:
    if isinstance(wanted, Mapping):
        return {"result": name, **wanted}
    if wanted not in ("min", "max"):
        raise ArgumentError(name, wanted, "'min', 'max', or a mapping such as {'at_most': '3 N*m'}")
    return {"result": name, "max": wanted == "max"}


def _condition(text: str) -> dict[str, Any]:
    parts = _CONDITION.fullmatch(text.strip())
    return {"result": text} if parts is None else {"result": parts[1], _RELATIONS[parts[2]]: _number(parts[3])}


def _number(text: str) -> float | str:
    """A number in SI; what has a unit, or is a name, stays a text."""
    try:
        return float(text)
    except ValueError:
        return text


def _expanded(base: Any, pattern: Sequence[str], before: str = "") -> Iterator[str]:
    """The paths of a pattern in a machine that has what the parameter belongs to."""
    name, *rest = pattern
    if not rest:
        yield before + name
    elif name == "*":
        for place, item in enumerate(base if isinstance(base, Sequence) else ()):
            yield from _expanded(item, rest, f"{before}{place}.")
    elif isinstance(base, Mapping) and name in base:
        yield from _expanded(base[name], rest, f"{before}{name}.")


def _put(base: Any, path: Sequence[str], value: object) -> Any:
    """A copy of a machine with another value at a path."""
    name, *rest = path
    if isinstance(base, Sequence) and not isinstance(base, str):
        if not name.isdecimal() or int(name) >= len(base):
            raise ArgumentError("path", name, f"a place from 0 to {len(base) - 1}")
        place = int(name)
        return [*base[:place], _put(base[place], rest, value) if rest else value, *base[place + 1 :]]
    inner = base if isinstance(base, Mapping) else {}
    return {**inner, name: _put(inner.get(name), rest, value) if rest else value}
