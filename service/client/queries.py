"""Query parameters and bodies of a client's requests."""

from __future__ import annotations

import json
from collections.abc import Iterator, KeysView, Mapping, Sequence, Set, ValuesView
from difflib import get_close_matches
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast

from sprag_study.service.client.case_tables import points_of
from sprag_study.service.client.errors import ArgumentError, SpecFileError
from sprag_study.service.plain_data import plain
from sprag_study.service.presets import preset_names, preset_text

if TYPE_CHECKING:
    from datetime import datetime

Value = float | int | str
Ends = tuple[Value, Value]
#: Paths of axes and their values.
Held = Mapping[str, Value | Sequence[Value]]
Spec = Mapping[str, Any]
#: Fields of a spec that say which cases it has, or how it chooses them.
CASE_FIELDS: Final = frozenset({"axes", "combine", "exclude", "refine", "goal", "calibrate"})


def spec_of(spec: Spec | str | PathLike[str], cases: object = None) -> Spec:
    """A spec given as data, as the name of a JSON or TOML file, or as that of a preset; SpecFileError about the file.

    ``cases`` is a table of cases (`points_of`) in place of what varies in the spec, whose ``axes`` can be one, too.
    """
    given = dict(spec) if isinstance(spec, Mapping) else _named_spec(spec)
    axes = given.get("axes")
    if cases is not None:
        return with_points(given, points_of(cases, "cases"))
    return {**given, "axes": [{"points": points_of(axes, "axes")}]} if hasattr(axes, "columns") else given


def with_points(spec: Spec, points: str) -> Spec:
    """A spec with the cases of a table, the text of a CSV file, in place of those that it has or chooses."""
    return {**without_cases(spec), "axes": [{"points": points}]}


def without_cases(spec: Spec) -> dict[str, Any]:
    """A spec without what says which cases it has, or how it chooses them."""
    return {name: part for name, part in spec.items() if name not in CASE_FIELDS}


def _named_spec(spec: str | PathLike[str]) -> dict[str, Any]:
    """The spec of a file or a preset."""
    path = Path(spec)
    if str(spec) in preset_names() and not path.exists():
        return preset(str(spec))
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or error
        near = get_close_matches(str(spec), preset_names(), 1)
        hint = f"; a study that comes with Sprag is called {near[0]!r}" if near else ""
        raise SpecFileError(f"cannot read a spec from the file {str(path)!r}: {reason}{hint}") from error
    return _read(path, text)


def preset(name: str) -> dict[str, Any]:
    """The spec of a study that comes with Sprag, to be changed and run; SpecFileError where there is none."""
    if name not in preset_names():
        raise SpecFileError(f"no study {name!r} comes with Sprag; these do: {', '.join(preset_names())}")
    file, text = preset_text(name)
    return _read(Path(file), text)


def _read(path: Path, text: str) -> dict[str, Any]:
    """The spec in the text of a file."""
    try:
        if path.suffix.lower() == ".toml":
            import tomllib

            return tomllib.loads(text)
        return cast("dict[str, Any]", json.loads(text))
    except ValueError as error:
        kind = "TOML" if path.suffix.lower() == ".toml" else "JSON"
        raise SpecFileError(f"the file {str(path)!r} is not valid {kind}: {error}") from error


def query_of(settings: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The query of settings by their names in addresses; what is None, False or empty is left to the service.

    A mapping of paths becomes texts such as "shaft.load=0.3 N*m"; numbers of numpy and quantities of pint become
    texts with their units. ArgumentError for what has no form as a text.
    """
    return [(name, text) for name, value in settings.items() for text in _texts(name, value)]


def _texts(name: str, value: object) -> list[str]:
    if value is None or value is False:
        return []
    if isinstance(value, Set | Iterator | KeysView | ValuesView):
        value = list(value)
    data, faults = plain(value)
    if faults:
        raise ArgumentError(name, value, "texts, numbers, and lists and mappings of them")
    if isinstance(data, dict):
        return [f"{path}={text}" for path, item in data.items() for text in _texts(name, item)]
    if isinstance(data, list):
        return [text for item in data for text in _texts(name, item)]
    return [str(data).lower() if isinstance(data, bool) else str(data)]


def extension(
    axes: Sequence[Mapping[str, Any]] | None,
    cases: Sequence[Mapping[str, Any]] | None,
    generations: int | None,
    name: str | None,
) -> dict[str, Any]:
    """Body of an extension of a study."""
    parts = {"axes": axes, "cases": cases, "generations": generations, "name": name}
    return {key: value for key, value in parts.items() if value is not None}


def finish_text(when: str | datetime) -> str:
    """A deadline for the service: a text unchanged, an aware time in RFC 3339."""
    return when if isinstance(when, str) else when.isoformat()


def form_of(path: Path) -> str:
    """The format by the ending of a file's name; ValueError for an unknown ending."""
    from sprag_study.service.formats import format_of

    form = format_of(path.name)
    if form is None:
        raise ValueError(f"cannot tell the format from the name {path.name!r}; pass it as `form`")
    return form
