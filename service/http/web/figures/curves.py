"""Curves and maps as figures that plotly draws in the browser: plain data, without colours of the page."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag.service.http.web.figures.thinning import thin
from sprag.service.results.curves import numbers
from sprag.service.results.regimes import DOUBTFUL, MARKED, MARKS, regimes_of, stretches
from sprag.service.results.wording import number, unit_text, words
from sprag.worker.codes import PENDING
from sprag.worker.models import WorkerEnding

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag.service.results.curves import Curve, Curves, Map
    from sprag.worker.models import ResultInfo

Figure = dict[str, Any]

#: Colours that people with any kind of colour vision tell apart (after Okabe and Ito), on light and on dark ground.
PALETTE: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f6fc4", "#8c6d31")
#: Markers and dashes say the same as the colours, for those who print in grey.
SYMBOLS: Final = ("circle", "square", "diamond", "triangle-up", "x", "triangle-down", "star", "cross")
DASHES: Final = ("solid", "dash", "dot", "dashdot")
#: Points that all lines of a figure may have together, and one line at least.
_MOST_POINTS: Final = 24_000
_LEAST_POINTS: Final = 400
#: Points of one line: the five that are kept of each column of pixels of a wide picture.
_LINE_POINTS: Final = 6_000
#: Lines with more points are drawn without markers.
_MARKED: Final = 60
#: Characters of the name of a study in a legend.
_MOST_LABEL: Final = 60
#: Pixels of a panel, alone and among others, and of what lies between two rows of panels.
_ALONE: Final = 360
_PANEL_HEIGHT: Final = 230
_ROW_GAP: Final = 45
#: Share of the width between two panels side by side.
_GAP: Final = 0.1


def axis_title(name: str, unit: str) -> str:
    """What stands at an axis: words and unit."""
    shown = unit_text(unit)
    return f"{escaped(words(name))} ({shown})" if shown else escaped(words(name))


def escaped(text: str) -> str:
    """Text that plotly does not take for its markup."""
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def curves_figure(drawn: Sequence[tuple[str, Curves]], columns: int = 1) -> Figure:
    """Curves of one study, or of several that are overlaid, as a figure: a panel for each result.

    Parameters
    ----------
    drawn : pairs of label and curves
        All with the same x and the same results; one study alone has the label "".
    columns : int
        Panels side by side.
    """
    chosen = drawn[0][1].selection
    if told := _nothing(drawn):
        return {"data": [], "layout": {}, "note": told}
    rows = math.ceil(len(chosen.results) / columns)
    lines = [(label, curve) for label, curves in drawn for curve in curves.curves]
    most = min(max(_MOST_POINTS // len(lines), _LEAST_POINTS), _LINE_POINTS)
    traces: list[Figure] = []
    for panel, info in enumerate(chosen.results):
        traces += [*_panel_traces(lines, info, panel, most), *_regime_traces(lines, info, panel)]
    named = len(lines) > 1 or any(trace["legendgroup"].startswith("regime ") for trace in traces)
    margin = {"t": 60 if named and len(lines) <= len(PALETTE) else 20, "r": 20, "b": 60, "l": 70}
    layout: Figure = {
        "height": _pixels(rows) + margin["t"] + margin["b"],
        "margin": margin,
        "hovermode": "closest",
        "showlegend": named,
        "legend": _legend(drawn, len(lines)),
        "uirevision": "keep",
    }
    for panel, info in enumerate(chosen.results):
        row, column = divmod(panel, columns)
        layout |= _panel_axes(panel, info, (row, rows), (column, columns))
        x_title = axis_title(chosen.names[chosen.x], chosen.units[chosen.x])
        last = panel + columns >= len(chosen.results)
        layout[_axis("xaxis", panel)] |= {"title": {"text": x_title if last else ""}}
    return {"data": traces, "layout": layout, "cases": True}


def _axis(name: str, panel: int) -> str:
    return name if panel == 0 else f"{name}{panel + 1}"


def _nothing(drawn: Sequence[tuple[str, Curves]]) -> str:
    """Why there is nothing to draw, as a sentence; "" where there is anything: empty axes would be made-up scales."""
    curves = [curve for _, found in drawn for curve in found.curves]
    if any(not np.all(np.isnan(y)) for curve in curves for y in curve.y.values()):
        return ""
    chosen = drawn[0][1].selection
    at = curves[0].line.at if curves else {}
    held = [f"{axis_name} = {number(value)} {unit_text(chosen.units[axis_name])}" for axis_name, value in at.items()]
    cases = (
        f"case at {', '.join(text.strip() for text in held)}" if held and len(drawn) == 1 else "case that is drawn here"
    )
    endings = {ending for curve in curves for ending in curve.endings}
    if endings <= {PENDING, WorkerEnding.CANCELLED}:
        return f"No {cases} {'is done yet' if PENDING in endings else 'was run before the study was cancelled'}."
    others = ", ".join(sorted(endings - {PENDING, WorkerEnding.CANCELLED}))
    return f"No {cases} has a result; they ended with: {others}."


def _pixels(rows: int) -> int:
    """Height of all rows of panels: each as high as in any other figure, however many there are."""
    return _ALONE if rows == 1 else rows * _PANEL_HEIGHT + (rows - 1) * _ROW_GAP


def _panel_axes(panel: int, info: ResultInfo, row: tuple[int, int], column: tuple[int, int]) -> Figure:
    """The axes of one panel of a grid; all x axes zoom together."""
    width = (1.0 - _GAP * (column[1] - 1)) / column[1]
    gap = _ROW_GAP / _pixels(row[1])
    height = (1.0 - gap * (row[1] - 1)) / row[1]
    left, top = column[0] * (width + _GAP), 1.0 - row[0] * (height + gap)
    suffix = "" if panel == 0 else str(panel + 1)
    x_axis: Figure = {"domain": [left, left + width], "anchor": f"y{suffix}", "zeroline": False}
    if panel:
        x_axis["matches"] = "x"
    return {
        f"xaxis{suffix}": x_axis,
        f"yaxis{suffix}": {
            "domain": [max(top - height, 0.0), top],
            "anchor": f"x{suffix}",
            "title": {"text": axis_title(info.name, info.unit)},
            "zeroline": False,
            "rangemode": "tozero",
        },
    }


def _legend(drawn: Sequence[tuple[str, Curves]], lines: int) -> Figure:
    """Few lines are named above the panels, which then have the whole width; many beside them, as are families."""
    # Beside the entries a title would take room that plotly does not count, and the last entries would be cut off.
    title: Figure = {"text": _legend_title(drawn), "side": "top"}
    if lines > len(PALETTE) or _named_apart(drawn):
        return {"title": title, "tracegroupgap": 0}
    return {"title": title, "orientation": "h", "x": 0, "y": 1.0, "yanchor": "bottom", "tracegroupgap": 0}


def _legend_title(drawn: Sequence[tuple[str, Curves]]) -> str:
    chosen = drawn[0][1].selection
    paths = list(chosen.lines[0].by)
    titles = [axis_title(chosen.names[path], chosen.units[path]) for path in paths]
    return "Study" if len(drawn) > 1 and not titles else ", ".join(titles)


def _named_apart(drawn: Sequence[tuple[str, Curves]]) -> bool:
    """Whether the name of a study stands over its lines, which are told apart by values."""
    return len(drawn) > 1 and bool(drawn[0][1].selection.lines[0].by)


def _short(label: str) -> str:
    """A long name without its middle: a legend has little room, and ends tell more of similar names apart."""
    return label if len(label) <= _MOST_LABEL else f"{label[: _MOST_LABEL - 25]}…{label[-24:]}"


def _panel_traces(lines: Sequence[tuple[str, Curve]], info: ResultInfo, panel: int, most: int) -> Iterator[Figure]:
    colours = line_colours(len(lines))
    styles = zip(colours, itertools.cycle(SYMBOLS), strict=False)
    labels = list(dict.fromkeys(label for label, _ in lines))
    for index, ((label, curve), (colour, symbol)) in enumerate(zip(lines, styles, strict=False)):
        run = curve.run()
        regimes = None if curve.regimes is None else [curve.regimes[place] for place in run.tolist()]
        y = curve.y[info.name][run]
        kept = thin(y, most)
        x = np.array(curve.line.x)[run]
        joined = bool(np.all(np.diff(x) > 0.0))
        drawn = _with_gaps(kept, regimes)
        study = escaped(_short(label))
        values = ", ".join(number(value) for value in curve.line.by.values())
        first = index == 0 or lines[index - 1][0] != label
        yield {
            "type": "scatter",
            "mode": ("lines+markers" if kept.size <= _MARKED else "lines") if joined else "markers",
            "name": values or study or escaped(words(info.name)),
            "legendgroup": str(index),
            "legendgrouptitle": {"text": study if values and first else ""},
            "showlegend": panel == 0,
            "x": [None if place is None else float(x[place]) for place in drawn],
            "y": [None if place is None or np.isnan(y[place]) else float(y[place]) for place in drawn],
            "customdata": [None if place is None else int(curve.line.cases[run][place]) for place in drawn],
            "connectgaps": False,
            "line": {"color": colour, "width": 1.8, "dash": DASHES[labels.index(label) % len(DASHES)]},
            "marker": {"color": colour, "symbol": symbol, "size": 6},
            "hovertemplate": f"%{{x:.5g}}, %{{y:.5g}} {unit_text(info.unit)}<br>case %{{customdata}}"
            f"<extra>{', '.join(text for text in (study, values) if text) or escaped(words(info.name))}</extra>",
            "xaxis": "x" if panel == 0 else f"x{panel + 1}",
            "yaxis": "y" if panel == 0 else f"y{panel + 1}",
        }


def _with_gaps(kept: NDArray[np.int64], regimes: list[str | None] | None) -> list[int | None]:
    """Places of the points of a line, None where it is broken."""
    if regimes is None:
        return list(kept.tolist())
    shown, drawn = set(kept.tolist()), list[int | None]()
    for stretch in stretches(regimes, len(regimes)):
        part = [place for place in stretch.tolist() if place in shown]
        drawn += [None, *part] if drawn and part else part
    return drawn


def _regime_traces(lines: Sequence[tuple[str, Curve]], info: ResultInfo, panel: int) -> Iterator[Figure]:
    """The points of each regime that is not periodic, upon the lines; and all regimes in the legend."""
    occurring = regimes_of(curve.regimes for _, curve in lines)
    for name in occurring if len(occurring) > 1 or set(occurring) & set(MARKED) else ():
        places = [(curve, place) for _, curve in lines for place, own in enumerate(curve.regimes or ()) if own == name]
        places = places if name in MARKED else []
        yield {
            "type": "scatter",
            "mode": "markers",
            "name": name,
            "legendgroup": f"regime {name}",
            "legendgrouptitle": {"text": "Regime" if name == occurring[0] else ""},
            "showlegend": panel == 0,
            "x": [curve.line.x[place] for curve, place in places] or [None],
            "y": numbers(np.array([curve.y[info.name][place] for curve, place in places])) or [None],
            "customdata": [int(curve.line.cases[place]) for curve, place in places] or [None],
            "marker": {"color": MARKS[name].colour, "symbol": MARKS[name].symbol, "size": 8},
            "hovertemplate": f"%{{x:.5g}}, %{{y:.5g}} {unit_text(info.unit)}<br>case %{{customdata}}"
            f"<extra>{name}</extra>",
            "xaxis": "x" if panel == 0 else f"x{panel + 1}",
            "yaxis": "y" if panel == 0 else f"y{panel + 1}",
        }


def line_colours(count: int) -> list[str]:
    """Colours that differ most for a few lines, and that follow the order of many."""
    if count <= len(PALETTE):
        return list(PALETTE[:count])
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    return [to_hex(colormaps["viridis"](0.92 * index / (count - 1))) for index in range(count)]


def map_figure(drawn: Map, contour: bool) -> Figure:
    """A map as a figure: colours, or lines of equal value with their numbers; gaps where there is no result."""
    drawn = drawn.run()
    trace: Figure = {
        "type": "contour" if contour else "heatmap",
        "x": list(drawn.x_values),
        "y": list(drawn.y_values),
        "z": [numbers(row) for row in drawn.values],
        "customdata": drawn.cases.tolist(),
        "colorscale": "Viridis",
        "colorbar": {"title": {"text": axis_title(drawn.result.name, drawn.result.unit), "side": "right"}},
        "hoverongaps": False,
        "hovertemplate": (
            f"{escaped(words(drawn.x))} %{{x:.5g}} {unit_text(drawn.units[0])}<br>"
            f"{escaped(words(drawn.y))} %{{y:.5g}} {unit_text(drawn.units[1])}<br>"
            f"%{{z:.5g}} {unit_text(drawn.result.unit)}<br>case %{{customdata}}<extra></extra>"
        ),
    }
    if contour:
        trace |= {"contours": {"showlabels": True}, "line": {"width": 1}, "connectgaps": False}
    doubtful = list(_doubtful_traces(drawn))
    return {
        "data": [trace, *doubtful],
        "layout": {
            "height": 520,
            "margin": {"t": 40 if doubtful else 20, "r": 20, "b": 60, "l": 70},
            "showlegend": bool(doubtful),
            "legend": {"orientation": "h", "x": 0, "y": 1.0, "yanchor": "bottom"},
            "xaxis": {"title": {"text": axis_title(drawn.names[0], drawn.units[0])}},
            "yaxis": {"title": {"text": axis_title(drawn.names[1], drawn.units[1])}},
        },
        "cases": True,
    }


def _doubtful_traces(drawn: Map) -> Iterator[Figure]:
    """The points of a map whose motion is not periodic, marked."""
    for name in DOUBTFUL:
        places = [
            (row, column)
            for row, regimes in enumerate(drawn.regimes or ())
            for column, own in enumerate(regimes)
            if own == name
        ]
        if places:
            yield {
                "type": "scatter",
                "mode": "markers",
                "name": name,
                "x": [drawn.x_values[column] for _, column in places],
                "y": [drawn.y_values[row] for row, _ in places],
                "customdata": [int(drawn.cases[place]) for place in places],
                "marker": {"color": MARKS[name].colour, "symbol": MARKS[name].symbol, "size": 8},
                "hovertemplate": f"case %{{customdata}}<extra>{name}</extra>",
            }
