"""Commands that draw what a running service has: curve, map, sensitivity."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sprag.service.cli.console import OK, cell_text, say, show_table, write_json, wrong_option
from sprag.service.cli.files import write_pieces
from sprag.service.cli.options import DEFAULT_SERVER, JsonFlag, Server, StudyId, Token
from sprag.service.cli.remote import connection

if TYPE_CHECKING:
    from sprag.service.answers import Value
    from sprag.service.client.plain import ServiceClient
    from sprag.service.client.wire import Drawn

HeldAt = Annotated[
    list[str] | None, typer.Option("--at", metavar="PATH=VALUE", help="Value at which another axis is held.")
]
PictureFile = Annotated[
    str | None, typer.Option("-o", "--output", metavar="FILE", help="Picture to write: .svg, .png or .pdf.")
]

ChosenOf = Annotated[
    list[str] | None,
    typer.Option("--of", metavar="PATH=VALUE", help="Value of an axis of --by that has a curve; default: all."),
]

_PICTURES = ("svg", "png", "pdf")
#: Indices and the headings of their columns.
_SHARES = {"first_order": "first order", "first_order_error": "+-", "total": "total", "total_error": "+-"}
_ELEMENTARY = {"mu": "mu", "mu_star": "mu*", "mu_star_error": "+-", "sigma": "sigma"}


def file_format(file: str, allowed: tuple[str, ...], what: str) -> str:
    """The format given by the ending of ``file``; raises WrongInputError when it is not in ``allowed``."""
    form = file.rpartition(".")[2].lower()
    if form not in allowed:
        names = ", ".join(f".{name}" for name in allowed[:-1]) + f" or .{allowed[-1]}"
        raise wrong_option(
            "--output", "invalid-choice", f"no kind of {what}", file, allowed=f"a name that ends in {names}"
        )
    return form


def answer(
    client: ServiceClient,
    study_id: str,
    part: Drawn,
    query: list[tuple[str, str]],
    file: str | None,
    show: Callable[[dict[str, Any]], None],
    as_json: bool,
    formats: tuple[str, ...] = _PICTURES,
    drawing: Sequence[tuple[str, str]] = (),
) -> None:
    """Show what the service draws of a study, and write it where a file is named; ``drawing`` is said for it only."""
    form = None if file is None else file_format(file, formats, "picture")
    found = client.drawn(study_id, part, query)
    if file is not None and form is not None:
        write_pieces(file, client.picture(study_id, part, [*query, *drawing], form))
    if as_json:
        write_json(found)
    else:
        show(found)
    if file is not None:
        say(f"{'table' if form == 'csv' else 'picture'}: {file}")


def curve(
    study_id: StudyId,
    x: Annotated[
        str | None,
        typer.Option("--x", metavar="PATH", help="Axis along the curve; default: that of the page."),
    ] = None,
    y: Annotated[
        list[str] | None,
        typer.Option("--y", metavar="RESULT", help="Result to draw; may be repeated; default: those of the page."),
    ] = None,
    by: Annotated[
        list[str] | None, typer.Option("--by", metavar="PATH", help="Axis with one curve for each value.")
    ] = None,
    at: HeldAt = None,
    of: ChosenOf = None,
    file: PictureFile = None,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Show results against an axis as a table, and write them as a picture."""
    query = [*([] if x is None else [("x", x)]), *(("y", name) for name in y or ())]
    query += [("by", path) for path in by or ()]
    query += [*(("at", item) for item in at or ()), *(("of", item) for item in of or ())]
    with connection(server, token) as client:
        answer(client, study_id, "curves", query, file, show_curves, as_json)


def draw_map(
    study_id: StudyId,
    x: Annotated[str, typer.Option("--x", metavar="PATH", help="Axis to the right, such as shaft.load.")],
    y: Annotated[str, typer.Option("--y", metavar="PATH", help="Axis upwards, such as excitation.frequency.")],
    z: Annotated[str, typer.Option("--z", metavar="RESULT", help="Result to draw.")],
    at: HeldAt = None,
    file: PictureFile = None,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Show one result over two axes as a table, and write it as a picture."""
    query = [("x", x), ("y", y), ("z", z), *(("at", item) for item in at or ())]
    with connection(server, token) as client:
        answer(client, study_id, "map", query, file, show_map, as_json)


def show_map(found: dict[str, Any]) -> None:
    """A line for each value of y, a column for each of x; of a refined map a line for each case."""
    held = held_text(found["at"], found["units"])
    title = heading(found["z"]["name"], found["z"]["unit"]) + (f"; {held}" if held else "")
    if "points" in found:
        _show_points(found, title)
        return
    corner = f"{heading(found['y']['path'], found['y']['unit'])} \\ {heading(found['x']['path'], found['x']['unit'])}"
    columns = [(corner, True), *((cell_text(value), True) for value in found["x"]["values"])]
    rows = [(y, *row) for y, row in zip(found["y"]["values"], found["z"]["values"], strict=True)]
    show_table(title, columns, rows)


def _show_points(found: dict[str, Any], title: str) -> None:
    """The cases of a refined map, and how right it is."""
    points, axes = found["points"], (found["x"], found["y"])
    columns = [*((heading(axis["path"], axis["unit"]), True) for axis in axes)]
    columns += [(heading(found["z"]["name"], found["z"]["unit"]), True), ("case", True)]
    show_table(title, columns, list(zip(points["x"], points["y"], points["z"], points["cases"], strict=True)))
    error = "not known yet" if found["error"] is None else f"{100.0 * found['error']:.2g} % of the range"
    say(
        f"error: {error}, {100.0 * found['error_asked']:.2g} % asked; "
        f"{100.0 * found['jumps_share']:.2g} % of the map is not interpolated"
    )


def sensitivity(
    study_id: StudyId,
    y: Annotated[list[str], typer.Option("--y", metavar="RESULT", help="Result; may be repeated.")],
    file: PictureFile = None,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Show what results depend on: the share of their variance for every axis, and the range of its main effect."""
    with connection(server, token) as client:
        answer(client, study_id, "sensitivity", [("y", name) for name in y], file, _show_sensitivity, as_json)


def _show_sensitivity(found: dict[str, Any]) -> None:
    for result in found["results"]:
        _show_effects(result)
    say(*(f"warning: {text}" for text in found["warnings"]))


def _show_effects(result: dict[str, Any]) -> None:
    way = "no shares" if result["method"] == "none" else f"method {result['method']}"
    title = f"{heading(result['result'], result['unit'])}: {result['cases']} cases, {way}"
    names = _ELEMENTARY if result["method"] == "morris" else _SHARES
    columns = [("axis", False), *((name, True) for name in names.values())]
    columns += [("least mean", True), ("largest mean", True)]
    rows = []
    for effect in result["effects"]:
        means = [value for value in effect["means"] if value is not None]
        indices = [effect[name] for name in names]
        rows.append((", ".join(effect["paths"]), *indices, min(means, default=None), max(means, default=None)))
    show_table(title, columns, rows)
    if result["pairs"]:
        told = [(", ".join(pair["paths"]), ", ".join(pair["other_paths"]), pair["second_order"], pair["error"])
                for pair in result["pairs"]]  # fmt: skip
        columns = [("axis", False), ("with", False), ("second order", True), ("+-", True)]
        show_table("interactions of two axes", columns, told)
    say(*(f"note: {text}" for text in result["notes"]))


def show_curves(found: dict[str, Any]) -> None:
    """One table for each curve: the axis, then every result against it; of a refined curve its error and jumps."""
    x = found["x"]
    columns = [(heading(x["path"], x["unit"]), True)]
    columns += [(heading(name, result["unit"]), True) for name, result in found["results"].items()]
    settled = all("regime" in drawn for drawn in found["curves"])
    columns += [("regime", False)] * settled + [("ending", False)]
    for drawn in found["curves"]:
        title = held_text({**drawn["by"], **drawn["at"]}, found["units"])
        regimes = [drawn["regime"]] if settled else []
        rows = zip(drawn["x"], *drawn["y"].values(), *regimes, drawn["endings"], strict=True)
        show_table(title, columns, [(*row[:-1], "" if row[-1] == OK else row[-1]) for row in rows])
        if "error" in drawn:
            say(*_refined(drawn, found["error_asked"], x["unit"]))
        elif "jumps" in drawn:
            say(*(f"jump at {_ends(jump, x['unit'])} ({jump['why']})" for jump in drawn["jumps"]))


def _refined(drawn: dict[str, Any], asked: float, unit: str) -> Iterator[str]:
    """What is told of a refined curve."""
    for name, error in drawn["error"].items():
        told = "not known yet" if error is None else f"{100.0 * error:.2g} % of the range"
        yield f"error of {name}: {told}, {100.0 * asked:.2g} % asked"
    for jump in drawn["jumps"]:
        why, results = jump["why"].replace("_", " "), ", ".join(jump["results"])
        yield f"jump at {_ends(jump, unit)} ({why}): {results} not interpolated"


def _ends(jump: dict[str, Any], unit: str) -> str:
    return f"{cell_text(jump['low'])} to {cell_text(jump['high'])}" + ("" if unit == "1" else f" {unit}")


def held_text(values: Mapping[str, Value], units: Mapping[str, str]) -> str:
    """The held parameters with their values and units."""
    texts = ((path, cell_text(value), units.get(path, "1")) for path, value in values.items())
    return ", ".join(f"{path} = {value}" + ("" if unit == "1" else f" {unit}") for path, value, unit in texts)


def heading(name: str, unit: str) -> str:
    """A column's heading: the name with its unit."""
    return name if unit == "1" else f"{name} [{unit}]"
