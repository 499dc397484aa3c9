"""What is exported: a study, its rows, and what each column of the table means."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from service.catalogue import parameter_of, unit_of

if TYPE_CHECKING:
    from service.storage.records import RowBlock
    from worker.kernels import ResultInfo
    from worker.study import Study


#: Parts of a spec that describe the machine and its run; the axes stand in the rows themselves.
_GIVEN: Final = ("base", "run")


@dataclass(frozen=True, slots=True)
class Source:
    """What is exported: a study, the description of its results, and where its rows come from, in order of cases.

    ``spec`` is the user's own, which has what is no number: kinds, formulas, tables, measured points.
    """

    study: Study
    infos: tuple[ResultInfo, ...]
    blocks: Iterable[RowBlock]
    about: dict[str, Any]
    spec: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Input:
    """One number of the machine, as a table of inputs shows it; ``varies`` tells that the axes change it."""

    path: str
    value: float | None
    unit: str
    description: str
    varies: bool


def description_of(study: Study, path: str) -> str:
    """What a flat SPEC path means, as a few words; "" where the catalogue does not have it."""
    entry = parameter_of(study, path)
    return "" if entry is None else entry.help


def inputs(study: Study) -> tuple[Input, ...]:
    """Every number of the study: the base's, and what varies, which has no single value."""
    varying = study.axis_paths
    paths = dict.fromkeys((*varying, *study.base))
    return tuple(
        Input(
            path,
            None if path in varying else study.base[path],
            unit_of(study, path),
            description_of(study, path),
            path in varying,
        )
        for path in paths
    )


def given(spec: Mapping[str, Any]) -> dict[str, Any]:
    """The machine and its run as the user wrote them, with their units: plain JSON data."""
    return {name: spec[name] for name in _GIVEN if spec.get(name)}


def given_texts(spec: Mapping[str, Any]) -> dict[str, str]:
    """The same, flat: ``base.mechanism.slider_crank.crank`` -> ``40 mm``; tables and lists as JSON text."""
    return {path: text for name, part in given(spec).items() for path, text in _flat(name, part)}


def _flat(path: str, value: object) -> Iterator[tuple[str, str]]:
    if isinstance(value, Mapping) and value:
        for name, item in value.items():
            yield from _flat(f"{path}.{name}", item)
    elif isinstance(value, list) and any(isinstance(item, Mapping) for item in value):
        for index, item in enumerate(value):
            yield from _flat(f"{path}.{index}", item)
    else:
        text = value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
        yield path, text.encode("utf-8", "backslashreplace").decode()


def run_texts(study: Study) -> dict[str, str]:
    """The settings of the run as people read them."""
    return {name: _text(value) for name, value in study.run.items() if value is not None}


def _text(value: object) -> str:
    if isinstance(value, list | tuple):
        if len(value) == 2 and isinstance(value[1], str):
            return f"{value[0]:g} {value[1]}"
        return " to ".join(map(_text, value))
    return f"{value:g}" if isinstance(value, float) else str(value)
