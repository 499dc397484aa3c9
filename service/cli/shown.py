"""Curves, maps and sensitivities as tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from sprag.service.cli.console import OK, cell_text, say, show_table, warning_lines
from sprag.service.languages import N_, _, decimal

if TYPE_CHECKING:
    from sprag.service.answers import Value

#: Indices and the headings of their columns.
_SHARES = {"first_order": N_("first order"), "first_order_error": "+-", "total": N_("total"), "total_error": "+-"}
_ELEMENTARY = {"mu": "mu", "mu_star": "mu*", "mu_star_error": "+-", "sigma": "sigma"}


def show_map(found: dict[str, Any]) -> None:
    """A line for each value of y, a column for each of x; of a refined map a line for each case."""
    held = held_text(found["at"], found["units"])
    title = heading(found["z"]["name"], found["z"]["unit"]) + (f"; {held}" if held else "")
    if "points" in found:
        _show_points(found, title)
        return
    corner = f"{heading(found['y']['path'], found['y']['unit'])} \\ {heading(found['x']['path'], found['x']['unit'])}"
    columns = [(corner, True), *((cell_text(value), True) for value in found["x"]["values"])]
    doubtful = found.get("flags") or [[[] for _ in found["x"]["values"]] for _ in found["y"]["values"]]
    rows = [
        (y, *(f"{cell_text(value)} *" if flags else value for value, flags in zip(row, own, strict=True)))
        for y, row, own in zip(found["y"]["values"], found["z"]["values"], doubtful, strict=True)
    ]
    show_table(title, columns, rows)
    counts = Counter(name for own in doubtful for flags in own for name in flags)
    if counts:
        say(_("* flags: {flags}", flags=", ".join(f"{name} {count}" for name, count in counts.items())))


def _show_points(found: dict[str, Any], title: str) -> None:
    """The cases of a refined map, and how right it is."""
    points, axes = found["points"], (found["x"], found["y"])
    columns = [*((heading(axis["path"], axis["unit"]), True) for axis in axes)]
    columns += [(heading(found["z"]["name"], found["z"]["unit"]), True), (_("case"), True)]
    show_table(title, columns, list(zip(points["x"], points["y"], points["z"], points["cases"], strict=True)))
    asked, jumps = _percent(found["error_asked"]), _percent(found["jumps_share"])
    say(
        _(
            "error: {error}, {asked} asked; {jumps} of the map is not interpolated",
            error=_error(found["error"]),
            asked=asked,
            jumps=jumps,
        )
    )


def _error(error: float | None) -> str:
    return _("not known") if error is None else _("{share} of the range", share=_percent(error))


def _percent(share: float) -> str:
    return decimal(f"{100.0 * share:.2g} %")


def show_sensitivity(found: dict[str, Any]) -> None:
    """A table for each result: shares of its variance or elementary effects, interactions, warnings."""
    for result in found["results"]:
        _show_effects(result)
    say(*warning_lines(found["warnings"]))


def _show_effects(result: dict[str, Any]) -> None:
    way = _("no shares") if result["method"] == "none" else _("method {name}", name=result["method"])
    named = heading(result["result"], result["unit"])
    title = _("{result}: {cases} cases, {way}", result=named, cases=result["cases"], way=way)
    names = _ELEMENTARY if result["method"] == "morris" else _SHARES
    columns = [(_("axis"), False), *((_(name), True) for name in names.values())]
    columns += [(_("least mean"), True), (_("largest mean"), True)]
    rows = []
    for effect in result["effects"]:
        means = [value for value in effect["means"] if value is not None]
        indices = [effect[name] for name in names]
        rows.append((", ".join(effect["paths"]), *indices, min(means, default=None), max(means, default=None)))
    show_table(title, columns, rows)
    if result["pairs"]:
        interactions = [(", ".join(pair["paths"]), ", ".join(pair["other_paths"]), pair["second_order"], pair["error"])
                for pair in result["pairs"]]  # fmt: skip
        columns = [(_("axis"), False), (_("with"), False), (_("second order"), True), ("+-", True)]
        show_table(_("interactions of two axes"), columns, interactions)
    say(*(_("note: {text}", text=_(text)) for text in result["notes"]))


def show_curves(found: Mapping[str, Any], of: str = "") -> None:
    """One table for each curve: the axis, then every result against it; of a refined curve its error and jumps.

    ``of`` is the name of its study, where there are several.
    """
    x = found["x"]
    columns = [(heading(x["path"], x["unit"]), True)]
    columns += [(heading(name, result["unit"]), True) for name, result in found["results"].items()]
    settled = all("regime" in drawn for drawn in found["curves"])
    doubts = [_doubts(drawn) for drawn in found["curves"]]
    flagged = any(map(any, doubts))
    columns += [(_("regime"), False)] * settled + [(_("flags"), False)] * flagged + [(_("ending"), False)]
    for drawn, flags in zip(found["curves"], doubts, strict=True):
        place = held_text({**drawn["by"], **drawn["at"]}, found["units"])
        title = ": ".join(filter(None, (of, place)))
        regimes = [drawn["regime"]] if settled else []
        rows = zip(drawn["x"], *drawn["y"].values(), *regimes, *[flags] * flagged, drawn["endings"], strict=True)
        show_table(title, columns, [(*row[:-1], "" if row[-1] == OK else row[-1]) for row in rows])
        if "error" in drawn:
            say(*_refined(drawn, found["error_asked"], x["unit"]))
        elif "jumps" in drawn:
            places = ((_ends(jump, x["unit"]), _(jump["why"])) for jump in drawn["jumps"])
            say(*(_("jump at {place} ({why})", place=place, why=why) for place, why in places))


def _doubts(drawn: Mapping[str, Any]) -> list[str]:
    """The flags of each point, except for those that its regime says."""
    regimes = drawn.get("regime") or [None] * len(drawn["x"])
    # A service of an earlier version does not tell them.
    points = zip(drawn.get("flags") or [()] * len(regimes), regimes, strict=True)
    return [", ".join(name for name in flags if name != regime) for flags, regime in points]


def _refined(drawn: dict[str, Any], asked: float, unit: str) -> Iterator[str]:
    """What is known of a refined curve, in sentences."""
    for name, error in drawn["error"].items():
        yield _("error of {name}: {error}, {asked} asked", name=name, error=_error(error), asked=_percent(asked))
    for jump in drawn["jumps"]:
        why, results = _(jump["why"].replace("_", " ")), ", ".join(jump["results"])
        place = _ends(jump, unit)
        yield _("jump at {place} ({why}): {results} not interpolated", place=place, why=why, results=results)


def _ends(jump: dict[str, Any], unit: str) -> str:
    ends = _("{low} to {high}", low=cell_text(jump["low"]), high=cell_text(jump["high"]))
    return ends + ("" if unit == "1" else f" {unit}")


def held_text(values: Mapping[str, Value], units: Mapping[str, str]) -> str:
    """The held parameters with their values and units."""
    texts = ((path, cell_text(value), units.get(path, "1")) for path, value in values.items())
    return ", ".join(f"{path} = {value}" + ("" if unit == "1" else f" {unit}") for path, value, unit in texts)


def heading(name: str, unit: str) -> str:
    """A column's heading: the name with its unit."""
    return name if unit == "1" else f"{name} [{unit}]"
