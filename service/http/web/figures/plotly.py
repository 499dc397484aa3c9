"""Figures as plotly data for the browser, without the colours of the page."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag.service.http.web.figures.thinning import thin
from sprag.service.json_text import numbers
from sprag.service.results.figures.curves import doubtful_marks, map_quantities
from sprag.service.results.figures.figure import OTHER_LOOK, PALETTE, shortened
from sprag.service.results.regimes import MARKS
from sprag.service.results.wording import unit_text, words

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag.service.results.curves import Map
    from sprag.service.results.figures.figure import Figure, Line, Marks, Panel, Quantity

Data = dict[str, Any]

#: Markers and dashes repeat the distinction by colour, for prints in grey.
SYMBOLS: Final = ("circle", "square", "diamond", "triangle-up", "x", "triangle-down", "star", "cross")
_DASHES: Final = ("solid", "dash", "dot", "dashdot")
#: Lines with more points are drawn without markers.
_MARKED: Final = 60
#: Characters of the name of a study in a legend.
_MOST_LABEL: Final = 60
#: Pixels of a panel, alone and among others, of what lies between two rows of panels, and of a row of states.
_ALONE: Final = 360
_PANEL_HEIGHT: Final = 230
_ROW_GAP: Final = 45
_STATES_HEIGHT: Final = 45
#: Share of the width between two panels side by side.
_GAP: Final = 0.1


def plotly_figure(figure: Figure) -> Data:
    """The figure as plotly's data and layout; a note where there is nothing to draw."""
    if figure.note:
        return {"data": [], "layout": {}, "note": figure.note}
    rows = figure.rows
    panels = _ALONE if rows == 1 and not figure.motion else rows * _PANEL_HEIGHT + (rows - 1) * _ROW_GAP
    strip = len(figure.spans) * _STATES_HEIGHT
    inner = panels + (strip + _ROW_GAP if strip else 0)
    marked = any(panel.marks for panel in figure.panels)
    named = len(figure.listed) > 1 or marked or bool(strip)
    beside = len(figure.listed) > len(PALETTE) or any(line.heading for line in figure.listed)
    margin = {"t": 60 if named and not beside else 20, "r": 20, "b": 60, "l": 70}
    layout: Data = {
        "height": inner + margin["t"] + margin["b"],
        "margin": margin,
        "hovermode": "x" if figure.motion else "closest",
        "showlegend": named,
        "legend": _legend(figure, beside=beside),
        "uirevision": "keep",
    }
    traces: list[Data] = []
    first = 1 if strip else 0  # the strip has the first pair of axes, and its x axis is that of all panels
    for index, panel in enumerate(figure.panels):
        suffix = "" if index + first == 0 else str(index + first + 1)
        low, high = _domain(index // figure.columns, rows, panels, inner)
        x_axis = "" if strip else suffix
        axes = {"xaxis": f"x{x_axis}", "yaxis": f"y{suffix}"}
        layout[f"yaxis{suffix}"] = _y_axis(panel, figure, (low, high), axes["xaxis"])
        if not strip:
            layout[f"xaxis{suffix}"] = _x_axis(figure, index, axes["yaxis"])
        headings: set[str] = set()
        for line in panel.lines:
            traces.append(_line_trace(line, panel, figure, headings) | axes)
        traces += [_marks_trace(marks, panel.y, index, place) | axes for place, marks in enumerate(panel.marks)]
    if strip:
        traces += _states(figure)
        layout |= {"barmode": "overlay", "bargap": 0.25, "xaxis": _x_axis(figure, len(figure.panels), "y")}
        layout["yaxis"] = {"domain": [0.0, strip / inner], "fixedrange": True, "zeroline": False, "showgrid": False}
    over_time = figure.motion and figure.x.unit == "s"
    cases = any(line.cases is not None for panel in figure.panels for line in panel.lines)
    return {"data": traces, "layout": layout, **({"zoom": True} if over_time else {"cases": True} if cases else {})}


def axis_title(quantity: Quantity) -> str:
    """The title of an axis: words and unit."""
    shown = unit_text(quantity.unit)
    return f"{_escaped(words(quantity.name))} ({shown})" if shown else _escaped(words(quantity.name))


def _escaped(text: str) -> str:
    """Escape text that plotly would interpret as markup."""
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def _domain(row: int, rows: int, panels: int, inner: int) -> tuple[float, float]:
    """Lower and upper end of a row of panels; the height of a panel does not depend on their number."""
    height = (panels - (rows - 1) * _ROW_GAP) / rows
    top = inner - row * (height + _ROW_GAP)
    return max((top - height) / inner, 0.0), top / inner


def _y_axis(panel: Panel, figure: Figure, domain: tuple[float, float], anchor: str) -> Data:
    axis: Data = {"domain": list(domain), "anchor": anchor, "title": {"text": axis_title(panel.y)}}
    return axis | ({"zeroline": True} if figure.motion else {"zeroline": False, "rangemode": "tozero"})


def _x_axis(figure: Figure, index: int, anchor: str) -> Data:
    """The x axis of a panel, or of all of them; all x axes zoom together."""
    width = (1.0 - _GAP * (figure.columns - 1)) / figure.columns
    left = (index % figure.columns) * (width + _GAP)
    title = axis_title(figure.x) if index + figure.columns >= len(figure.panels) else ""
    axis: Data = {"domain": [left, left + width], "anchor": anchor, "zeroline": False, "title": {"text": title}}
    axis |= {"dtick": 60} if figure.x.unit == "°" else {}
    return axis | ({"matches": "x"} if anchor != "y" else {})


def _legend(figure: Figure, *, beside: bool) -> Data:
    """The legend: above the panels for few lines, which leaves them the whole width; beside them for many or
    families.
    """
    text = ", ".join(map(axis_title, figure.family)) or ("Study" if figure.studies > 1 else "")
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
    heading, name = (_escaped(shortened(text, _MOST_LABEL)) for text in (line.heading, line.name))
    title = "" if heading in headings else heading
    headings.add(heading)
    marked = line.cases is not None and (kept.size <= _MARKED or not line.joined)
    trace: Data = {
        "type": "scatter",
        "mode": "+".join(["lines"] * line.joined + ["markers"] * marked),
        "name": name or _escaped(words(panel.y.name)),
        "legendgroup": line.key,
        "legendgrouptitle": {"text": title},
        "showlegend": line.listed,
        "x": [None if place is None else float(line.x[place]) for place in places],
        "y": [None if place is None or np.isnan(line.y[place]) else float(line.y[place]) for place in places],
        "connectgaps": False,
        "line": {"color": line.colour, "width": 1.8, "dash": _DASHES[line.style % len(_DASHES)]},
    }
    if line.cases is None:
        return trace
    told = ", ".join(text for text in (heading, name) if text) or _escaped(words(panel.y.name))
    return trace | {
        "customdata": [None if place is None else int(line.cases[place]) for place in places],
        "marker": {"color": line.colour, "symbol": SYMBOLS[int(line.key) % len(SYMBOLS)], "size": 6},
        "hovertemplate": _hover(panel.y, told),
    }


def _hover(y: Quantity, told: str) -> str:
    return f"%{{x:.5g}}, %{{y:.5g}} {unit_text(y.unit)}<br>case %{{customdata}}<extra>{told}</extra>"


def _with_gaps(kept: NDArray[np.int64], stretches: tuple[NDArray[np.int64], ...] | None) -> list[int | None]:
    """Indices of the points of a line, None where it is broken."""
    if stretches is None:
        return list(kept.tolist())
    shown, drawn = set(kept.tolist()), list[int | None]()
    for stretch in stretches:
        part = [place for place in stretch.tolist() if place in shown]
        drawn += [None, *part] if drawn and part else part
    return drawn


def _marks_trace(marks: Marks, y: Quantity, panel: int, place: int) -> Data:
    """The points of a regime; a regime without points appears in the legend only."""
    return {
        "type": "scatter",
        "mode": "markers",
        "name": marks.regime,
        "legendgroup": f"regime {marks.regime}",
        "legendgrouptitle": {"text": "" if place else "Regime"},
        "showlegend": panel == 0,
        "x": marks.x.tolist() or [None],
        "y": numbers(marks.y) or [None],
        "customdata": marks.cases.tolist() or [None],
        "marker": {"color": MARKS[marks.regime].colour, "symbol": MARKS[marks.regime].symbol, "size": 8},
        "hovertemplate": _hover(y, marks.regime),
    }


def _states(figure: Figure) -> Iterator[Data]:
    """States over time: a row for each part of the machine, a colour and a pattern for each state."""
    bars: dict[str, list[tuple[float, float, str]]] = {}
    for row, spans in figure.spans.items():
        for state, begin, end in spans:
            bars.setdefault(state, []).append((begin, end - begin, row))
    for state, found in bars.items():
        colour, pattern, _ = figure.looks.get(state, OTHER_LOOK)
        begins, widths, rows = map(list, zip(*found, strict=True))
        yield {
            "type": "bar",
            "orientation": "h",
            "base": begins,
            "x": widths,
            "y": rows,
            "name": words(state).lower(),
            "legendgroup": "states",
            "legendgrouptitle": {"text": "States"},
            "marker": {
                "color": colour,
                "pattern": {"shape": pattern, "fgcolor": "#333333", "bgcolor": colour, "size": 6},
                "line": {"width": 0},
            },
            "hovertemplate": f"%{{y}}: {words(state).lower()}<extra></extra>",
        }


def map_figure(drawn: Map, contour: bool) -> Data:
    """A map as a figure: colours, or lines of equal value with their numbers; gaps where there is no result."""
    drawn = drawn.run()
    x, y, z = map_quantities(drawn)
    trace: Data = {
        "type": "contour" if contour else "heatmap",
        "x": list(drawn.x_values),
        "y": list(drawn.y_values),
        "z": [numbers(row) for row in drawn.values],
        "customdata": drawn.cases.tolist(),
        "colorscale": "Viridis",
        "colorbar": {"title": {"text": axis_title(z), "side": "right"}},
        "hoverongaps": False,
        "hovertemplate": (
            f"{_escaped(words(drawn.x))} %{{x:.5g}} {unit_text(x.unit)}<br>"
            f"{_escaped(words(drawn.y))} %{{y:.5g}} {unit_text(y.unit)}<br>"
            f"%{{z:.5g}} {unit_text(z.unit)}<br>case %{{customdata}}<extra></extra>"
        ),
    }
    if contour:
        trace |= {"contours": {"showlabels": True}, "line": {"width": 1}, "connectgaps": False}
    doubtful = [_marks_trace(marks, y, 0, 1) for marks in doubtful_marks(drawn)]
    return {
        "data": [trace, *doubtful],
        "layout": {
            "height": 520,
            "margin": {"t": 40 if doubtful else 20, "r": 20, "b": 60, "l": 70},
            "showlegend": bool(doubtful),
            "legend": {"orientation": "h", "x": 0, "y": 1.0, "yanchor": "bottom"},
            "xaxis": {"title": {"text": axis_title(x)}},
            "yaxis": {"title": {"text": axis_title(y)}},
        },
        "cases": True,
    }
