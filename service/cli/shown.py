"""The answers of views of a study as tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import chain
from typing import TYPE_CHECKING, Any

from sprag_study.service.cli.console import (
    OK,
    Column,
    Heading,
    cell_text,
    heading,
    in_unit,
    piped,
    say,
    show_table,
    unit_of,
    warning_lines,
    write_rows,
    write_text,
)
from sprag_study.service.languages import N_, _, decimal

if TYPE_CHECKING:
    from sprag_study.service.answers import Value
    from sprag_study.service.answers.key import AnswerValue
    from sprag_study.service.reading.reader import Reading

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
    x, y, unit = found["x"], found["y"], found["z"]["unit"]
    corner = Heading(f"{heading(y['path'], y['unit'])} \\ {heading(x['path'], x['unit'])}", y["unit"])
    columns: list[Column] = [(corner, True)]
    columns += [(Heading(cell_text(in_unit(value, x["unit"])), unit), True) for value in x["values"]]
    doubtful = found.get("flags") or [[[] for _ in found["x"]["values"]] for _ in found["y"]["values"]]
    rows = [
        (
            y,
            *(
                f"{cell_text(in_unit(value, unit))} *" if flags else value
                for value, flags in zip(row, own, strict=True)
            ),
        )
        for y, row, own in zip(found["y"]["values"], found["z"]["values"], doubtful, strict=True)
    ]
    show_table(title, columns, rows)
    counts = Counter(name for own in doubtful for flags in own for name in flags)
    if counts:
        say(_("* flags: {flags}", flags=", ".join(f"{name} {count}" for name, count in counts.items())))


def _show_points(found: dict[str, Any], title: str) -> None:
    """The cases of a refined map, and how right it is."""
    points, axes = found["points"], (found["x"], found["y"])
    columns: list[Column] = [*((heading(axis["path"], axis["unit"]), True) for axis in axes)]
    columns += [(heading(found["z"]["name"], found["z"]["unit"]), True), (_("case"), True)]
    show_table(title, columns, list(zip(points["x"], points["y"], points["z"], points["cases"], strict=True)))
    asked, jumps, error = _percent(found["error_asked"]), _percent(found["jumps_share"]), _error(found["error"])
    if found.get("error_asked_absolute"):
        unit = found["z"]["unit"]
        asked = _absolute(found["error_asked"], unit, 5)
        error = error if found["error"] is None else _absolute(found["error_absolute"], unit)
    say(
        _(
            "error: {error}, {asked} asked; {jumps} of the map is not interpolated",
            error=error,
            asked=asked,
            jumps=jumps,
        )
    )


def _error(error: float | None) -> str:
    return _("not known") if error is None else _("{share} of the range", share=_percent(error))


def _absolute(error: float, unit: str, digits: int = 2) -> str:
    return f"{decimal(f'{in_unit(error, unit):.{digits}g}')} {unit_of(unit)}".rstrip()


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
    unit = result["unit"]
    of_names = unit if result["method"] == "morris" else "1"
    columns: list[Column] = [(_("axis"), False), *((Heading(_(name), of_names), True) for name in names.values())]
    columns += [(Heading(_(name), unit), True) for name in (N_("least mean"), N_("largest mean"))]
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
    columns: list[Column] = [(heading(x["path"], x["unit"]), True)]
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
            say(*_refined(drawn, found, x["unit"]))
        elif "jumps" in drawn:
            places = ((_ends(jump, x["unit"]), _(jump["why"])) for jump in drawn["jumps"])
            say(*(_("jump at {place} ({why})", place=place, why=why) for place, why in places))


def write_curves(named: Sequence[tuple[str, Mapping[str, Any]]]) -> None:
    """The points of the curves of several studies for programs: a row each, with the study and what is held."""
    first = named[0][1]
    heads = ["study", "held", heading(first["x"]["path"], first["x"]["unit"])]
    heads += [heading(name, result["unit"]) for name, result in first["results"].items()]
    rows = []
    for study, found in named:
        for drawn in found["curves"]:
            held = held_text({**drawn["by"], **drawn["at"]}, found["units"])
            regimes = drawn.get("regime") or [None] * len(drawn["x"])
            points = zip(drawn["x"], *drawn["y"].values(), regimes, _doubts(drawn), drawn["endings"], strict=True)
            rows += [(study, held, *point) for point in points]
    write_rows([*heads, "regime", "flags", "ending"], rows)


def _doubts(drawn: Mapping[str, Any]) -> list[str]:
    """The flags of each point, except for those that its regime says."""
    regimes = drawn.get("regime") or [None] * len(drawn["x"])
    # A service of an earlier version does not tell them.
    points = zip(drawn.get("flags") or [()] * len(regimes), regimes, strict=True)
    return [", ".join(name for name in flags if name != regime) for flags, regime in points]


def _refined(drawn: dict[str, Any], found: Mapping[str, Any], unit: str) -> Iterator[str]:
    """What is known of a refined curve, in sentences."""
    for name, error in drawn["error"].items():
        bound = found.get("errors_asked", {}).get(name, {"value": found["error_asked"], "absolute": False})
        wanted, of = _percent(bound["value"]), found["results"][name]["unit"]
        text = _error(error)
        if bound["absolute"]:
            wanted = _absolute(bound["value"], of, 5)
            text = text if error is None else _absolute(drawn["error_absolute"][name], of)
        yield _("error of {name}: {error}, {asked} asked", name=name, error=text, asked=wanted)
    for jump in drawn["jumps"]:
        why, results = _(jump["why"].replace("_", " ")), ", ".join(jump["results"])
        place = _ends(jump, unit)
        yield _("jump at {place} ({why}): {results} not interpolated", place=place, why=why, results=results)
    for stretch in drawn.get("irregular", ()):
        place = _ends(stretch, unit)
        for name in [name for name in stretch["half_widths"] if name in found["results"]]:
            size = _absolute(stretch["half_widths"][name], found["results"][name]["unit"])
            yield _("irregular at {place}: {name} within {size} of the line", place=place, name=name, size=size)


def _ends(jump: dict[str, Any], unit: str) -> str:
    low, high = (cell_text(in_unit(jump[end], unit)) for end in ("low", "high"))
    return f"{_('{low} to {high}', low=low, high=high)} {unit_of(unit)}".rstrip()


def held_text(values: Mapping[str, Value], units: Mapping[str, str]) -> str:
    """The held parameters with their values and units."""
    known = ((path, value, units.get(path, "1")) for path, value in values.items())
    return ", ".join(f"{path} = {cell_text(in_unit(value, si))} {unit_of(si)}".rstrip() for path, value, si in known)


def show_ribbon(found: dict[str, Any]) -> None:
    """A table for each line and result: the nominal drive and the quantiles at each place; then the causes."""
    for line in found["lines"]:
        held = held_text({**line["by"], **line["at"]}, found["units"])
        for name, result in line["results"].items():
            unit = found["results"][name]["unit"]
            title = _("{result}, {drives} drives", result=heading(name, unit), drives=found["drives"])
            columns: list[Column] = [*_x_column(found), (Heading(_("nominal"), unit), True)]
            columns += [(Heading(f"{100.0 * p:g} %", unit), True) for p in found["quantiles"]]
            columns += [(_("failed"), True)]
            x = [line["x"]] if found["x"] else []
            rows = list(zip(*x, result["nominal"], *result["values"], line["failed"], strict=True))
            show_table(f"{title}; {held}" if held else title, columns, rows)
            _show_causes(_("causes of the spread of {name}", name=name), result["causes"])


def show_yield(found: dict[str, Any]) -> None:
    """A table for each line: the yield at each place; then the yield everywhere, the causes and the worst drives."""
    title = _(" and ").join(condition["text"] for condition in found["conditions"])
    for line in found["lines"]:
        held = held_text({**line["by"], **line["at"]}, found["units"])
        heads = (_("yield"), _("from"), _("to"), _("drives"), _("failed"))
        columns = [*_x_column(found), *((head, True) for head in heads)]
        x = [line["x"]] if found["x"] else []
        shares = [[_share(share[part]) for share in line["each"]] for part in ("value", "low", "high")]
        rows = list(zip(*x, *shares, [share["drives"] for share in line["each"]], line["failed"], strict=True))
        show_table(f"{title}; {held}" if held else title, columns, rows)
        if found["x"]:
            say(_("at every place: {share}", share=yield_text(line["all"])))
        _show_causes(_("causes of missing the conditions"), line["causes"])
        if line["worst"]:
            names = list(line["worst"][0]["results"])
            columns = [(_("drive"), True), (_("case"), True), *_x_column(found), (_("margin"), True)]
            columns += [(name, True) for name in names]
            rows = [
                (one["drive"], one["case"], *([one["x"]] if "x" in one else []), _share(one["margin"]),
                 *one["results"].values())
                for one in line["worst"]
            ]  # fmt: skip
            show_table(_("worst drives"), columns, rows)


def yield_text(share: dict[str, Any]) -> str:
    """A yield in words."""
    if share["value"] is None:
        return _("no drive is run yet")
    low, high = _share(share["low"]), _share(share["high"])
    value = _share(share["value"])
    return _("{value} ({low} to {high}) of {drives} drives", value=value, low=low, high=high, drives=share["drives"])


def _x_column(found: dict[str, Any]) -> list[Column]:
    return [(heading(found["x"]["path"], found["x"]["unit"]), True)] if found["x"] else []


def _show_causes(title: str, causes: dict[str, Any]) -> None:
    known = [item for item in causes["shares"] if item["share"] is not None]
    known.sort(key=lambda item: -item["share"])
    if known:
        rows = [(item["tolerance"], _share(max(item["share"], 0.0)), _share(item["error"])) for item in known]
        show_table(title, [(_("tolerance"), False), (_("share"), True), ("+-", True)], rows)
    if causes["note"]:
        say(_("note: {text}", text=_(causes["note"])))


def _share(share: float | None) -> str:
    return "" if share is None else f"{cell_text(round(100.0 * share, 1))} %"


def show_answers(found: dict[str, Any], reading_of: Callable[[], Reading]) -> None:
    """A table for each curve: its answers and its working point; then the extremes among all cases."""
    reading = reading_of()
    x = heading(found["x"] or "", found["unit"] or "1")
    columns: list[Column] = [
        (_("answer"), False, True),
        (_("value"), True),
        (_("unit"), False),
        (x, True),
        (_("cases"), False),
        (_("note"), False),
    ]
    unit = found["unit"] or "1"
    for curve in found["curves"]:
        title = held_text({**curve["by"], **curve["at"]}, found["units"])
        every = (*curve["answers"], *curve["working_point"])
        show_table(title, columns, [_answer_row(item, unit, reading) for item in every])
    if found["overall"]:
        columns[3] = (_("case with"), False)
        rows = [
            (*row[:3], held_text(item["parameters"], found["units"]), *row[4:])
            for item in found["overall"]
            for row in [_answer_row(item, "1", reading)]
        ]
        show_table(_("among all cases"), columns, rows)


def _answer_row(item: AnswerValue, x_unit: str, reading: Reading) -> tuple[object, ...]:
    from sprag_study.service.results.key_answer_words import note_of

    title = reading.caption(item["title"]) if item["title"] == item["result"] else _(item["title"])
    value = in_unit(item["value"], item["unit"])
    if item["above"] and value is not None:
        value = f"> {cell_text(value)}"
    cases, note = ", ".join(map(str, item["cases"])), note_of(item, x_unit).said(reading)
    return title, value, unit_of(item["unit"]), item["x"], cases, note


def show_designs(found: dict[str, Any]) -> None:
    """A line for each design, the best first."""
    counts = found["counts"]
    parts = [
        _("{count} designs", count=counts["known"]),
        _("{count} feasible", count=counts["feasible"]),
        _("{count} on the front", count=counts["front"]),
    ]
    if counts["pending"]:
        parts.append(_("{count} still to be run", count=counts["pending"]))
    columns = [(name, True) for name in (_("design"), _("case"))]
    columns += [(_lines(goal["result"], goal["unit"]), True) for goal in found["best"]]
    columns += [(_lines(one["name"], one["unit"]), True) for one in found["variables"]]
    limited, points = _limited(found), len(found["at"])
    columns += [
        (_lines(name if points == 1 else _("{name} at {number}", name=name, number=number), unit), True)
        for name, unit in limited.items()
        for number in range(1, points + 1)
    ]
    rows = [
        (
            design["design"],
            design["cases"][0],
            *design["goals"].values(),
            *design["variables"].values(),
            *chain.from_iterable(design["results"][name] for name in limited),
            *(design[name] for name in ("feasible", "exact", "rank")),
            ", ".join(dict.fromkeys([*filter(None, design["regimes"] or ()), *design["flags"]])),
        )
        for design in found["designs"]
    ]
    columns += [(_("feasible"), False), (_("exact"), False), (_("rank"), True), (_("motion"), False)]
    show_table(", ".join(parts), columns, rows)
    if "fresh" in found and not piped():
        _show_fresh(found)


def _show_fresh(found: dict[str, Any]) -> None:
    """A line for each value of the best designs with drives that the search has not seen."""
    units = {item["result"]: item["unit"] for item in (*found["best"], *found["subject_to"])}
    rows = [
        (
            one["design"],
            name if len(own["values"]) == 1 else _("{name} at {number}", name=name, number=number),
            *(in_unit(end, units[name]) for end in ends),
            unit_of(units[name]),
        )
        for one in found["fresh"]
        for name, own in one["results"].items()
        for number, ends in enumerate(zip(own["values"], own["low"], own["high"], strict=True), 1)
    ]
    title = _("{count} drives that the search has not seen", count=found["fresh"][0]["drives"])
    columns = [(_("design"), True), (_("result"), False), (_("value"), True)]
    columns += [(_("from"), True), (_("to"), True), (_("unit"), False)]
    show_table(title, columns, rows)


def _limited(found: dict[str, Any]) -> dict[str, str]:
    """Names and units of the results of limits; without those that the columns of goals show."""
    goals = {goal["result"] for goal in found["best"]} if len(found["at"]) == 1 else ()
    return {limit["result"]: limit["unit"] for limit in found["subject_to"] if limit["result"] not in goals}


def _lines(name: str, unit: str) -> Heading:
    """The heading of a narrow column: a line for each part of the name, and one for the unit."""
    return Heading(heading(name, unit).replace(".", ".\n").replace(" ", "\n"), unit)


def show_cases(found: dict[str, Any]) -> None:
    """A line for each case in its order."""
    units = {item["name"]: item["unit"] for item in found["quantities"]}
    columns: list[Column] = [(_("case"), True), *((heading(name, unit), True) for name, unit in units.items())]
    columns += [(_("ending"), False), (_("regime"), False), (_("flags"), False)]
    rows = [
        (
            case["case"],
            *({**case["parameters"], **case["results"]}.get(name) for name in units),
            case["ending"],
            case["regime"] or "",
            ", ".join(case["flags"]),
        )
        for case in found["cases"]
    ]
    show_table(_("{selected} of {known} cases", selected=found["selected"], known=found["known"]), columns, rows)


def show_calibration(found: dict[str, Any]) -> None:
    """Values with their intervals, correlations, and what to do next; for programs one table with all numbers."""
    heads = (_("parameter"), _("value"), _("from"), _("to"), _("deviation"))
    columns = [(head, place > 0) for place, head in enumerate(heads)]
    rows: list[tuple[object, ...]] = []
    for one in found["parameters"]:
        numbers = (one["value"], *(one["interval"] or (None, None)), one["deviation"])
        rows.append((heading(one["name"], one["unit"]), *(in_unit(number, one["unit"]) for number in numbers)))
    names = [one["name"] for one in found["parameters"]]
    correlations = (found["correlations"] or []) if len(names) > 1 else []
    if piped():  # a table has its sentences beside it
        if correlations:
            columns += [(f"{_('correlation')} {name}", True) for name in names]
            rows = [(*row, *line) for row, line in zip(rows, correlations, strict=True)]
        show_table("", columns, rows)
        say(*found["sentences"])
        return
    show_table(_("Values and 95 % intervals"), columns, rows)
    if correlations:
        lines = [(name, *row) for name, row in zip(names, correlations, strict=True)]
        show_table(_("Correlations"), [("", False), *((name.replace(".", ".\n"), True) for name in names)], lines)
    write_text("".join(f"{sentence}\n" for sentence in found["sentences"]))
