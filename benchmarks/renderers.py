"""Six described figures drawn by this program and by Vega-Lite: bytes, compressed bytes and times.

Vega-Lite is drawn on the server by vl-convert, which is no dependency of this program: install vl-convert-python
first. Times are the least of a few, in one run, in turns. docs/adr/0044-one-renderer.md has the figures and what
else was compared.

    python -m benchmarks.renderers [--repeats 3]
"""

from __future__ import annotations

import argparse
import gzip
import json
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from sprag_study.service.figures.figure import Figure, Line, Panel, Quantity, line_colours
from sprag_study.service.figures.pictures import picture_file
from sprag_study.service.figures.svg import picture_svg, svg

LOAD, SPEED = Quantity("Load torque", "N*m"), Quantity("Mean shaft speed", "rpm")
X = np.linspace(0.0, 1.6, 60)


def curve(place: int, points: int, count: int) -> Line:
    """A falling curve of cases."""
    x = np.linspace(0.0, 1.6, points)
    y = (400.0 + 60.0 * place) / (1.0 + np.exp(6.0 * (x - 0.5 - 0.1 * place)))
    return Line(f"{place + 1} mm", x, y, line_colours(count)[place], key=str(place), cases=np.arange(points) + place)


def curves(count: int, points: int, panels: int = 1) -> Figure:
    """Curves in panels."""
    lines = tuple(curve(place, points, count) for place in range(count))
    family = (Quantity("Amplitude", "mm"),)
    return Figure(LOAD, tuple(Panel(SPEED, lines) for _ in range(panels)), min(panels, 2), family)


def points(count: int) -> Figure:
    """Cases that nothing joins."""
    x, y = np.random.default_rng(1).random((2, count))
    line = Line("cases", x, y, line_colours(1)[0], key="0", cases=np.arange(count), joined=False)
    return Figure(LOAD, (Panel(SPEED, (line,), x=LOAD),), most=count)


def figures() -> Iterator[tuple[str, Figure]]:
    """Six figures."""
    yield "one curve of 60 cases", curves(1, 60)
    yield "4 curves, 4 results", curves(4, 11, panels=4)
    yield "40 curves", curves(40, 60)
    yield "1 curve of 10^5 cases", curves(1, 100_000)
    yield "1200 designs", points(1_200)
    yield "10^5 points", points(100_000)


def vega_lite(figure: Figure) -> dict[str, Any]:
    """The same panels and lines in Vega-Lite's grammar."""
    views = []
    for panel in figure.panels:
        rows = [
            {"x": x, "y": y, "line": line.name, "case": case}
            for line in panel.lines
            for x, y, case in zip(
                line.x.tolist(),
                line.y.tolist(),
                (line.cases if line.cases is not None else line.x).tolist(),
                strict=True,
            )
        ]
        mark = (
            {"type": "line", "point": True} if panel.lines[0].joined else {"type": "point", "filled": True, "size": 12}
        )
        encoding = {
            "x": {"field": "x", "type": "quantitative", "title": figure.x.name},
            "y": {"field": "y", "type": "quantitative", "title": panel.y.name},
            "color": {"field": "line", "type": "nominal"},
            "tooltip": [{"field": name} for name in ("x", "y", "case")],
        }
        views.append({"data": {"values": rows}, "mark": mark, "encoding": encoding, "width": 500, "height": 300})
    return {"$schema": "https://vega.github.io/schema/vega-lite/v6.json", "concat": views, "columns": figure.columns}


def least(make: Callable[[], str | bytes], repeats: int) -> tuple[float, bytes]:
    """The least time of some calls, and what they make."""
    times, picture = [], b""
    for _ in range(repeats):
        begin = time.perf_counter()
        drawn = make()
        times.append(time.perf_counter() - begin)
        picture = drawn.encode() if isinstance(drawn, str) else drawn
    return min(times), picture


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    try:
        import vl_convert
    except ImportError:
        vl_convert = None
    for name, figure in figures():
        ways: dict[str, Callable[[], str | bytes]] = {
            "SVG of a page": lambda figure=figure: svg(figure, width=1100, cases="/studies/st_0/cases/"),
            "SVG of a file": lambda figure=figure: picture_svg(figure, ""),
            "PNG": lambda figure=figure: picture_file(picture_svg(figure, ""), "png"),
            "PDF": lambda figure=figure: picture_file(picture_svg(figure, ""), "pdf"),
        }
        if vl_convert is not None:
            ways["Vega-Lite for the browser"] = lambda figure=figure: json.dumps(vega_lite(figure))
            ways["Vega-Lite's SVG"] = lambda figure=figure: str(vl_convert.vegalite_to_svg(vega_lite(figure)))
        for way, make in ways.items():
            seconds, drawn = least(make, options.repeats)
            packed = len(gzip.compress(drawn)) / 1e3
            print(f"{name:24} {way:26} {len(drawn) / 1e3:9.1f} kB {packed:8.1f} kB compressed {1e3 * seconds:8.1f} ms")


if __name__ == "__main__":
    main()
