"""Query parameters and bodies of a client's requests."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from sprag.service.client.errors import SpecFileError
from sprag.service.plain_data import plain
from sprag.service.presets import preset_names, preset_text

if TYPE_CHECKING:
    from datetime import datetime

Value = float | int | str
Ends = tuple[Value, Value]
Spec = Mapping[str, Any]


def spec_of(spec: Spec | str | PathLike[str]) -> Spec:
    """A spec given as data, as the name of a JSON or TOML file, or as that of a preset; SpecFileError about the file.

    ``axes`` of data can be a table of pandas or polars: a column for each parameter, a row for each case.
    """
    if isinstance(spec, Mapping):
        axes: Any = spec.get("axes")
        return {**spec, "axes": [{"points": _csv(axes)}]} if hasattr(axes, "columns") else spec
    path = Path(spec)
    if str(spec) in preset_names() and not path.exists():
        return preset(str(spec))
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise SpecFileError(f"cannot read a spec from the file {str(path)!r}: {reason}") from error
    return _read(path, text)


def _csv(table: Any) -> str:
    """The text of a CSV file of a table of cases."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows(zip(*(plain(table[name])[0] for name in table.columns), strict=True))
    return text.getvalue()


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


def curve_query(
    x: str | None,
    y: str | Sequence[str],
    by: str | Sequence[str],
    at: Mapping[str, Value] | None,
    number: int | None = None,
    of: Mapping[str, Sequence[Value]] | None = None,
) -> list[tuple[str, str]]:
    """Query of curves: ``at`` maps paths to values, SI numbers or texts with a unit, ``of`` to several."""
    query = [
        *([] if x is None else [("x", x)]),
        *(("y", name) for name in _listed(y)),
        *(("by", path) for path in _listed(by)),
    ]
    query += [("at", f"{path}={value}") for path, value in (at or {}).items()]
    query += [("of", f"{path}={value}") for path, values in (of or {}).items() for value in values]
    return query + given({"number": number})


def answers_query(
    point: Value | None,
    x: str | None,
    by: str | Sequence[str],
    at: Mapping[str, Value] | None,
    of: Mapping[str, Sequence[Value]] | None,
) -> list[tuple[str, str]]:
    """Query of the answers of a study: as of curves, and a working point; None leaves that to the service."""
    return [*curve_query(x, (), by, at, of=of), *given({"point": point})]


def explore_query(
    where: str | Sequence[str],
    sort: str | None,
    limit: int | None,
    show: str | Sequence[str],
    ending: str | None,
    regime: str | None,
    flag: str | None,
) -> list[tuple[str, str]]:
    """Query of a selection of cases; None leaves a parameter to the service."""
    query = [*(("where", text) for text in _listed(where)), *(("show", name) for name in _listed(show))]
    return [*query, *case_query(ending, regime, flag), *given({"sort": sort, "limit": limit})]


def ribbon_query(
    x: str | None,
    y: str | Sequence[str],
    by: str | Sequence[str],
    at: Mapping[str, Value] | None,
    quantiles: Sequence[float],
) -> list[tuple[str, str]]:
    """Query of a ribbon: as of curves, and probabilities of quantiles (none leaves them to the service)."""
    return [*curve_query(x, y, by, at), *(("quantile", repr(float(value))) for value in quantiles)]


def yield_query(
    conditions: str | Sequence[str],
    x: str | None,
    by: str | Sequence[str],
    at: Mapping[str, Value] | None,
    worst: int | None,
) -> list[tuple[str, str]]:
    """Query of a yield; None leaves the number of worst drives to the service."""
    more = [] if worst is None else [("worst", str(worst))]
    return [*(("condition", text) for text in _listed(conditions)), *curve_query(x, (), by, at), *more]


def case_query(ending: str | None, regime: str | None, flag: str | None) -> list[tuple[str, str]]:
    """Query of the cases with an ending, a regime and a flag; None leaves that open."""
    given = (("ending", ending), ("regime", regime), ("flag", flag))
    return [(name, value) for name, value in given if value is not None]


def cases_query(
    ending: str | None,
    regime: str | None,
    flag: str | None,
    where: str | Sequence[str],
    at: Mapping[str, Value] | None,
    sort: str | None,
) -> list[tuple[str, str]]:
    """Query of a list of cases; None leaves a parameter to the service."""
    query = [*case_query(ending, regime, flag), *(("where", text) for text in _listed(where))]
    return [*query, *(("at", f"{path}={value}") for path, value in (at or {}).items()), *given({"sort": sort})]


def longer_query(regime: str | None, at_most: int | None) -> list[tuple[str, str]]:
    """Query of a longer study; None leaves a parameter to the service."""
    given = (("regime", regime), ("at_most", at_most))
    return [(name, str(value)) for name, value in given if value is not None]


def narrow_query(steps: int | None, at: Mapping[str, Value] | None) -> list[tuple[str, str]]:
    """Query of a narrowed sweep; None leaves the steps to the service."""
    return [*given({"steps": steps}), *(("at", f"{path}={value}") for path, value in (at or {}).items())]


def branch_query(along: str, low: Value | None, high: Value | None, **more: Value | None) -> list[tuple[str, str]]:
    """Query of a branch, or of a diagram with ``more`` parameters; None leaves one to the service."""
    return [("along", along), *given({"from": low, "to": high, **more})]


def transient_query(kind: str, points: int | None, **settings: Value | None) -> list[tuple[str, str]]:
    """Query of a transient; None leaves a parameter to the service."""
    return [("kind", kind), *given({**settings, "points": points})]


def basin_query(
    x: str | None, y: str | None, x_range: Ends | None, y_range: Ends | None, points: int | None
) -> list[tuple[str, str]]:
    """Query of a basin; None leaves a parameter to the service."""
    ends = {
        f"{name}_{place}": value
        for name, values in (("x", x_range), ("y", y_range))
        for place, value in zip(("from", "to"), values or (None, None), strict=True)
    }
    return given({"x": x, "y": y, **ends, "points": points})


def given(query: Mapping[str, Value | None]) -> list[tuple[str, str]]:
    """Those parameters of a query that are not None."""
    return [(name, str(value)) for name, value in query.items() if value is not None]


def result_query(y: str | Sequence[str]) -> list[tuple[str, str]]:
    """Query of results by their names."""
    return [("y", name) for name in _listed(y)]


def front_query(limit: int | None, exact: bool) -> list[tuple[str, str]]:
    """Query of the designs of a study with a goal; None leaves the number of designs to the service."""
    return [("exact", str(exact).lower()), *([] if limit is None else [("limit", str(limit))])]


def extension(
    axes: Sequence[Mapping[str, Any]] | None, cases: Sequence[Mapping[str, Any]] | None, name: str | None
) -> dict[str, Any]:
    """Body of an extension of a study."""
    parts = {"axes": axes, "cases": cases, "name": name}
    return {key: value for key, value in parts.items() if value is not None}


def finish_text(when: str | datetime) -> str:
    """A deadline for the service: a text unchanged, an aware time in RFC 3339."""
    return when if isinstance(when, str) else when.isoformat()


def form_of(path: Path) -> str:
    """The format by the ending of a file's name; ValueError for an unknown ending."""
    from sprag.service.formats import format_of

    form = format_of(path.name)
    if form is None:
        raise ValueError(f"cannot tell the format from the name {path.name!r}; pass it as `form`")
    return form


def _listed(names: str | Sequence[str]) -> list[str]:
    return [names] if isinstance(names, str) else list(names)
