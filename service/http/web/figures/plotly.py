"""Figures as plotly data for the browser, without the colours of the page."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag.service.figures.figure import BANDS, NEUTRAL, NOTES, PALETTE, shortened
from sprag.service.figures.orders import motion_text
from sprag.service.figures.painter.thinning import thin
from sprag.service.json_text import numbers
from sprag.service.languages import decimal, gettext
from sprag.service.reading.reader import shown
from sprag.service.reading.wording import unit_text
from sprag.service.results.regimes import MARKS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag.service.figures.figure import Band, Figure, Fill, Line, Marks, NoteKind, Panel, Quantity

Data = dict[str, Any]

_NOTE_SYMBOLS: Final[dict[NoteKind, str]] = {
    "largest": "triangle-down",
    "smallest": "triangle-up",
    "point": "circle-open",
}
#: Dashes repeat the distinction by colour, as markers do.
_DASHES: Final = ("solid", "dash", "dot", "dashdot")
#: Characters of the name of a study in a legend.
_MOST_LABEL: Final = 60
#: Characters on a line of a heading above one column of panels.
_NARROW_HEADING: Final = 44
#: Pixels of a panel, alone and among others, of what lies between two rows of panels, of a row of states, and of one
#: of orders.
_ALONE: Final = 360
_PANEL_HEIGHT: Final = 230
_ROW_GAP: Final = 45
#: Pixels between rows of panels each of which has its own x axis.
_OWN_AXIS_GAP: Final = 85
_STATES_HEIGHT: Final = 45
_ORDERS_HEIGHT: Final = 26
#: Name and place of the legend that tells of motions: below the panels, over the whole width.
MOTIONS: Final = "legend2"
BELOW: Final[Data] = {
    "orientation": "h", "x": 0, "xanchor": "left", "y": 0, "yref": "container", "yanchor": "bottom", "tracegroupgap": 0,
}  # fmt: skip
#: Share of the width between two panels side by side.
_GAP: Final = 0.12
#: The same of a motion, whose numbers have more digits and whose legend leaves less room.
_MOTION_GAP: Final = 0.15
#: Shares for a scale, and between it and its panel.
_SCALE: Final = 0.09
_BAR_GAP: Final = 0.005


def plotly_figure(figure: Figure) -> Data:
    """The figure as plotly's data and layout; a note where there is nothing to draw."""
    if figure.note:
        return {"data": [], "layout": {}, "note": figure.note}
    rows = figure.rows
    gap = _OWN_AXIS_GAP if figure.apart else _ROW_GAP
    height = _ALONE if figure.apart or (rows == 1 and not figure.motion) else _PANEL_HEIGHT
    panels = rows * height + (rows - 1) * gap
    strip = len(figure.spans) * (_STATES_HEIGHT if figure.motion else _ORDERS_HEIGHT)
    inner = panels + (strip + _ROW_GAP if strip else 0)
    named = len(figure.listed) > 1 or figure.motion
    beside = len(figure.listed) > len(PALETTE) or any(line.heading for line in figure.listed)
    margin = {"t": 60 if (named and not beside) or figure.heading else 20, "r": 20, "b": 60, "l": 70}
    layout: Data = {
        "height": inner + margin["t"] + margin["b"],
        "margin": margin,
        "hovermode": "x" if figure.motion else "closest",
        "showlegend": named or bool(figure.regimes or strip or figure.banded or figure.noted),
        "legend": _legend(figure, beside=beside),
        MOTIONS: {**BELOW, "title": {"text": figure.title_of_marks, "side": "top"}},
        "uirevision": "keep",
        **separators(),
    }
    if figure.heading:
        # A narrow picture has one column, and no room for a long line.
        lines = wrap(figure.heading, _NARROW_HEADING) if figure.columns == 1 else [figure.heading]
        layout["title"] = {"text": "<br>".join(map(escaped, lines)), "font": {"size": 14}, "x": 0, "xref": "paper"}
    traces: list[Data] = []
    shapes: list[Data] = []
    first = figure.columns if strip else 0  # strips have the first axes, and their x axes are those of the panels above
    for index, panel in enumerate(figure.panels):
        suffix = _suffix(index + first)
        top = inner - index // figure.columns * (height + gap)
        low, high = max((top - height) / inner, 0.0), top / inner
        x_axis = _suffix(index % figure.columns) if strip else suffix
        axes = {"xaxis": f"x{x_axis}", "yaxis": f"y{suffix}"}
        layout[f"yaxis{suffix}"] = _y_axis(panel, figure, (low, high), axes["xaxis"])
        if not strip:
            layout[f"xaxis{suffix}"] = _x_axis(figure, index, axes["yaxis"])
        headings: set[str] = set()
        traces += [trace | axes for fill in panel.fills for trace in _fill(fill, named=named)]
        for line in panel.lines:
            trace = _line_trace(line, panel, figure, headings) | axes
            if line.shades is not None:
                right = _across(figure, index)[1] + _BAR_GAP
                trace["marker"]["colorbar"] |= {"x": right, "y": (low + high) / 2.0, "len": high - low}
            traces.append(trace | {"showlegend": line.listed and named})
        traces += [marks_trace(marks, panel.y, listed=index == 0) | axes for marks in panel.marks]
        traces += [trace | axes for trace in note_traces(panel, figure.noted, listed=index == 0)]
        over = {"xref": axes["xaxis"], "yref": f"{axes['yaxis']} domain"}
        shapes += [_band(band) | over for band in panel.bands]
        shapes += [] if figure.at is None else [_at(figure.at) | over]
    traces += _strips(figure, first, rows, strip / inner if strip else 0.0, layout)
    if shapes:
        layout["shapes"] = shapes
    if figure.banded:
        traces.append(_band_entry())
    return {"data": traces, "layout": layout, **({"below": figure.below} if figure.below else {}), **_kind(figure)}


def _kind(figure: Figure) -> Data:
    """What the page does with a figure: it zooms into a motion over time, and opens the cases of points."""
    if figure.motion and figure.x.unit == "s":
        return {"zoom": True}
    cases = any(line.cases is not None for panel in figure.panels for line in panel.lines)
    return {"cases": True} if cases else {}


def _strips(figure: Figure, columns: int, rows: int, share: float, layout: Data) -> list[Data]:
    """The states below the panels of each column, on ``share`` of the height; their axes go into the layout."""
    traces: list[Data] = []
    for column in range(columns):
        suffix = _suffix(column)
        axes = {"xaxis": f"x{suffix}", "yaxis": f"y{suffix}"}
        traces += [trace | axes for trace in _states(figure, listed=column == 0)]
        layout[f"xaxis{suffix}"] = _x_axis(figure, rows * figure.columns + column, axes["yaxis"])
        layout[f"yaxis{suffix}"] = {
            "domain": [0.0, share],
            "anchor": axes["xaxis"],
            "type": "category",
            "ticks": "",
            "fixedrange": True,
            "zeroline": False,
            "showgrid": False,
        }
        layout |= {"barmode": "overlay", "bargap": 0.25}
    return traces


def separators() -> Data:
    """The decimal mark of the language and the sign between thousands."""
    return {"separators": f"{decimal('.')}\N{NARROW NO-BREAK SPACE}"}


def _suffix(number: int) -> str:
    """What the names of the axes of that number end in."""
    return "" if number == 0 else str(number + 1)


def axis_title(quantity: Quantity) -> str:
    """The title of an axis: what it is called, and its unit."""
    shown = unit_text(quantity.unit)
    return f"{escaped(quantity.name)} ({shown})" if shown and quantity.name else escaped(quantity.name) or shown


def escaped(text: str) -> str:
    """Escape text that plotly would interpret as markup."""
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def _y_axis(panel: Panel, figure: Figure, domain: tuple[float, float], anchor: str) -> Data:
    axis: Data = {"domain": list(domain), "anchor": anchor, "title": {"text": axis_title(panel.y)}}
    return axis | ({"zeroline": False, "rangemode": "tozero"} if figure.from_zero else {"zeroline": True})


def _x_axis(figure: Figure, index: int, anchor: str) -> Data:
    """The x axis of a panel, or of all of them; all x axes zoom together, unless they are of different quantities."""
    across = _across(figure, index)
    title = axis_title(figure.x) if index + figure.columns >= len(figure.panels) else ""
    if figure.apart:
        own = figure.panels[index].x or figure.x
        return {"domain": across, "anchor": anchor, "zeroline": False, "title": {"text": axis_title(own)}}
    axis: Data = {"domain": across, "anchor": anchor, "zeroline": False, "title": {"text": title}}
    axis |= {"dtick": 60} if figure.x.unit == "°" else {}
    return axis | ({"matches": "x"} if anchor != "y" else {})


def _across(figure: Figure, index: int) -> list[float]:
    """Left and right end of a panel; beside panels with a scale there is room for it."""
    scaled = any(line.shades is not None for panel in figure.panels for line in panel.lines)
    plain = _MOTION_GAP if figure.motion else _GAP
    gap, edge = (plain + _SCALE, 0.0 if figure.columns > 1 else _SCALE) if scaled else (plain, 0.0)
    width = (1.0 - edge - gap * (figure.columns - 1)) / figure.columns
    left = (index % figure.columns) * (width + gap)
    return [left, left + width]


def _legend(figure: Figure, *, beside: bool) -> Data:
    """The legend: above the panels for few lines, which leaves them the whole width; beside them for many or
    families.
    """
    text = ", ".join(map(axis_title, figure.family)) or (gettext("Study") if figure.studies > 1 else "")
    # plotly ignores the height of a title beside the entries, so the last entries would be cut off.
    title: Data = {"text": text, "side": "top"}
    if beside:
        more = {"tracegroupgap": 8, "groupclick": "toggleitem"} if figure.motion else {"tracegroupgap": 0}
        return {"title": title, **more}
    return {"title": title, "orientation": "h", "x": 0, "y": 1.0, "yanchor": "bottom", "tracegroupgap": 0}


def _line_trace(line: Line, panel: Panel, figure: Figure, headings: set[str]) -> Data:
    """A line; the first one of a heading shows the heading."""
    kept = thin(line.y, figure.most)
    places = _with_gaps(kept, line.stretches)
    heading, name = (escaped(shortened(text, _MOST_LABEL)) for text in (line.heading, line.name))
    title = "" if heading in headings else heading
    headings.add(heading)
    marked = line.marked(kept.size)
    trace: Data = {
        "type": "scatter",
        "mode": "+".join(["lines"] * line.joined + ["markers"] * marked),
        "name": name or escaped(panel.y.name),
        "legendgroup": line.key,
        "legendgrouptitle": {"text": title},
        "showlegend": line.listed,
        "x": [None if place is None else float(line.x[place]) for place in places],
        "y": [None if place is None or np.isnan(line.y[place]) else float(line.y[place]) for place in places],
        "connectgaps": False,
        "line": {"color": line.colour, "width": 3.2 if line.wide else 1.8, "dash": _DASHES[line.style % len(_DASHES)]},
    }
    if line.cases is None:
        return trace if line.joined else trace | _points(line, kept, panel, figure.scale)
    label = ", ".join(text for text in (heading, name) if text) or escaped(panel.y.name)
    size: int | list[int] = 6
    if not marked and any(stretch.size == 1 for stretch in line.stretches or ()):
        trace["mode"], size = "lines+markers", _lone(places)
    return trace | {
        "customdata": [None if place is None else int(line.cases[place]) for place in places],
        "marker": {"color": line.colour, "symbol": line.marker, "size": size},
        "hovertemplate": _hover(panel.y, label),
    }


def _points(line: Line, kept: NDArray[np.int64], panel: Panel, scale: str) -> Data:
    """Points that are no cases: open ones, or in the colours of numbers, with the scale of these."""
    x = unit_text(panel.x.unit if panel.x else "")
    where = f"%{{x:.5g}} {x}, %{{y:.6g}} {unit_text(panel.y.unit)}<extra>{escaped(line.name)}</extra>"
    if line.ring:
        marker: Data = {"symbol": f"{line.marker}-open", "size": 12, "color": line.colour, "line": {"width": 2}}
        return {"marker": marker, "hovertemplate": where}
    if line.shades is None:
        return {"marker": {"symbol": line.marker, "size": 5, "color": line.colour}, "hovertemplate": where}
    numbers = line.shades[kept].tolist()
    marker = {"symbol": line.marker, "size": 6, "color": numbers, "colorscale": "Viridis", "showscale": line.style == 0}
    marker["colorbar"] = {"title": {"text": escaped(scale), "side": "right"}, "thickness": 12}
    return {"customdata": numbers, "marker": marker, "hovertemplate": f"{scale} %{{customdata}}: {where}"}


def _hover(y: Quantity, label: str) -> str:
    return f"%{{x:.5g}}, %{{y:.5g}} {unit_text(y.unit)}<br>{case_text()}<extra>{label}</extra>"


def case_text() -> str:
    """The case of a point, which plotly writes into the text."""
    return gettext("case {case}", case="%{customdata}")


def _with_gaps(kept: NDArray[np.int64], stretches: tuple[NDArray[np.int64], ...] | None) -> list[int | None]:
    """Indices of the points of a line, None where it is broken."""
    if stretches is None:
        return list(kept.tolist())
    shown, drawn = set(kept.tolist()), list[int | None]()
    for stretch in stretches:
        part = [place for place in stretch.tolist() if place in shown]
        drawn += [None, *part] if drawn and part else part
    return drawn


def _lone(places: list[int | None]) -> list[int]:
    """Sizes of markers that show only the points between two gaps, of which no line is seen."""
    around = [None, *places, None]
    return [6 if before is None and after is None else 0 for before, after in zip(around, around[2:], strict=False)]


def marks_trace(marks: Marks, y: Quantity, *, listed: bool) -> Data:
    """The points of a regime; a regime without points appears in the legend only."""
    return {
        "type": "scatter",
        "mode": "markers",
        "name": motion_text(marks.regime),
        "legend": MOTIONS,
        "legendgroup": f"regime {marks.regime}",
        "showlegend": listed,
        "x": marks.x.tolist() or [None],
        "y": numbers(marks.y) or [None],
        "customdata": marks.cases.tolist() or [None],
        "marker": {"color": MARKS[marks.regime].colour, "symbol": MARKS[marks.regime].symbol, "size": 8},
        "hovertemplate": _hover(y, motion_text(marks.regime)),
    }


def note_traces(panel: Panel, kinds: Sequence[NoteKind], *, listed: bool) -> Iterator[Data]:
    """The points of each kind that are read off lines; a kind without points appears in the legend only."""
    for kind in kinds:
        notes = [note for note in panel.notes if note.kind == kind]
        ring = kind == "point"
        yield {
            "type": "scatter",
            "mode": "markers+text",
            "name": shown(NOTES[kind]),
            "legend": MOTIONS,
            "legendgroup": f"note {kind}",
            "showlegend": listed,
            "x": [note.x for note in notes] or [None],
            "y": [note.y for note in notes] or [None],
            "text": [escaped(note.text) for note in notes],
            "textposition": [f"top {'left' if panel.on_the_right(note) else 'right'}" for note in notes] or "top right",
            "textfont": {"size": 12},
            "cliponaxis": False,
            "marker": {
                "color": [note.colour for note in notes],
                "symbol": _NOTE_SYMBOLS[kind],
                "size": 13 if ring else 10,
                "line": {"width": 2 if ring else 0},
            },
            "hovertemplate": f"%{{x:.5g}}, %{{y:.5g}} {unit_text(panel.y.unit)}<extra>{shown(NOTES[kind])}</extra>",
        }


def _at(x: float | None) -> Data:
    """The line across a panel at the working point."""
    line = {"color": NEUTRAL, "width": 1, "dash": "dot"}
    return {"type": "line", "x0": x, "x1": x, "y0": 0, "y1": 1, "layer": "below", "line": line}


def _fill(fill: Fill, *, named: bool) -> tuple[Data, Data]:
    """The area between two lines: its lower edge, and the upper one, which is filled down to it."""
    x = fill.x.tolist()
    edge: Data = {
        "type": "scatter", "mode": "lines", "x": x, "line": {"width": 0, "color": fill.colour}, "hoverinfo": "skip",
        "legendgroup": fill.key, "showlegend": False, "connectgaps": False,
    }  # fmt: skip
    red, green, blue = (int(fill.colour[at : at + 2], 16) for at in (1, 3, 5))
    upper = {"y": numbers(fill.high), "fill": "tonexty", "fillcolor": f"rgba({red}, {green}, {blue}, 0.2)"}
    return edge | {"y": numbers(fill.low)}, edge | upper | {"name": fill.name, "showlegend": fill.listed and named}


def _band(band: Band) -> Data:
    """A jump of a curve, behind the lines over the whole height of its panel."""
    return {
        "type": "rect", "x0": band.low, "x1": band.high, "y0": 0, "y1": 1, "layer": "below", "fillcolor": band.colour,
        "opacity": 0.25, "line": {"color": band.colour, "width": 1}, "legendgroup": band.key,
    }  # fmt: skip


def _band_entry() -> Data:
    """The entry of the legend for all jumps."""
    return {
        "type": "scatter", "mode": "markers", "name": shown(BANDS), "legend": MOTIONS, "x": [None], "y": [None],
        "showlegend": True, "marker": {"color": "rgba(119, 119, 119, 0.4)", "symbol": "square", "size": 12},
        "hoverinfo": "skip",
    }  # fmt: skip


def _states(figure: Figure, *, listed: bool) -> Iterator[Data]:
    """States along x: a row for each part of the machine or curve, a colour and a pattern for each state."""
    bars: dict[str, list[tuple[float, float, str]]] = {}
    for row, spans in figure.spans.items():
        for state, begin, end in spans:
            bars.setdefault(state, []).append((begin, end - begin, row))
    for place, (state, (colour, pattern, _)) in enumerate(figure.shown_looks.items()):
        begins, widths, rows = map(list, zip(*bars[state], strict=True))
        yield {
            "type": "bar",
            "orientation": "h",
            "base": begins,
            "x": widths,
            "y": rows,
            "name": motion_text(state),
            **_state_group(figure, state, first=place == 0),
            "showlegend": listed and state not in figure.regimes,
            "marker": {
                "color": colour,
                "pattern": {"shape": pattern, "fgcolor": "#333333", "bgcolor": colour, "size": 6},
                "line": {"width": 0},
            },
            "hovertemplate": f"%{{y}}: {motion_text(state)}<extra></extra>",
        }


def _state_group(figure: Figure, state: str, *, first: bool) -> Data:
    """Which legend a state is in: beside a motion one block, otherwise the legend of motions."""
    if figure.motion:
        return {"legendgroup": "states", "legendgrouptitle": {"text": figure.states if first else ""}}
    return {"legend": MOTIONS, "legendgroup": f"state {state}"}
