"""Tables of a machine from CSV files: ``--file operation=torque.csv`` puts a file's text in place of a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from sprag_study.service.cli.console import WrongInputError, wrong_option
from sprag_study.service.languages import N_, _

#: What has a table, and what else in it stays when a file takes the place of its table, its formula or its links. The
#: names are not imported: a command for a running service does without the models.
_KEPT: Final[Mapping[str, frozenset[str]]] = {
    "mechanism": frozenset({"interpolation"}),
    "operation": frozenset(
        {"quantity", "over", "during", "sense", "interpolation", "scale", "efficiency", "efficiency_is", "recorded_at"}
    ),
    "indicator": frozenset({"over", "interpolation", "piston_area", "back_pressure", "recorded_at"}),
    "torque": frozenset({"interpolation"}),
    "motor": frozenset({"interpolation", "inertia", "rated_torque", "scale"}),
}
_ALLOWED = N_("PLACE=FILE, such as operation=torque.csv, drive.motor=motor.csv or parts.0.operation.indicator=p.csv")


def named(files: Sequence[str]) -> list[tuple[str, str]]:
    """Places and names of files; WrongInputError where one is not ``PLACE=FILE``."""
    found = [(place.strip(), name) for place, _, name in (text.partition("=") for text in files)]
    for text, (place, name) in zip(files, found, strict=True):
        if not place or not name:
            raise wrong_option("--file", "wrong-type", N_("is not a place and a file"), text, allowed=_(_ALLOWED))
    return found


def with_tables(spec: Mapping[str, Any], texts: Sequence[tuple[str, str]]) -> dict[str, Any]:
    """The spec with the CSV texts at their places in ``base``, instead of the tables there.

    Raises
    ------
    WrongInputError
        Where the spec has no such place.
    """
    made = {**spec, "base": _copied(spec.get("base"))}
    for place, text in texts:
        *owners, name = place.removesuffix(".csv").split(".")
        owner: Any = made["base"]
        for key in owners:
            owner = _within(owner, key)
        found = _within(owner, name)
        if not isinstance(owner, dict) or found is None or name not in _KEPT:
            raise _missing(place)
        kept = {key: value for key, value in found.items() if key in _KEPT[name]} if isinstance(found, dict) else {}
        owner[name] = {**kept, **({"kind": "table"} if name == "motor" else {}), "csv": text}
    return made


def _missing(place: str) -> WrongInputError:
    message = N_("there is no such part in the base of the spec, to which a table could be given")
    return wrong_option("--file", "unknown-name", message, place, allowed=_(_ALLOWED))


def _within(data: Any, name: str) -> Any:
    """A member of an object or of a list; None where there is none."""
    if isinstance(data, list):
        return data[int(name)] if name.isdecimal() and int(name) < len(data) else None
    return data.get(name) if isinstance(data, dict) else None


def _copied(data: Any) -> Any:
    if isinstance(data, Mapping):
        return {name: _copied(part) for name, part in data.items()}
    return [_copied(part) for part in data] if isinstance(data, list) else data
