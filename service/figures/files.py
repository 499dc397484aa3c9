"""Files of pictures: an SVG as it is, as PNG and as PDF through Typst, the same bytes for the same picture."""

from __future__ import annotations

import re
from functools import cache
from typing import Any, Final, Literal, cast, get_args

from sprag.worker.pool.child_process import uncounted

Picture = Literal["svg", "png", "pdf"]
PICTURES: Final[tuple[Picture, ...]] = get_args(Picture)
MEDIA_TYPES: Final[dict[Picture, str]] = {"svg": "image/svg+xml", "png": "image/png", "pdf": "application/pdf"}

#: Pixels of a PNG for each of its SVG.
_FINE: Final = 2
_SIZE: Final = re.compile(r'<svg [^>]*?viewBox="0 0 ([\d.]+) ([\d.]+)"')
_PAGE: Final = """#set page(width: {width}pt, height: {height}pt, margin: 0pt)
#image(bytes(sys.inputs.picture), format: "svg", width: 100%)
"""


def picture_file(svg: str, form: Picture) -> bytes:
    """A picture as a file of a form; its fonts are those of Typst, never of the system."""
    if form == "svg":
        return svg.encode()
    found = _SIZE.search(svg)
    assert found is not None
    page = _PAGE.format(width=found[1], height=found[2]).encode()
    further: dict[str, Any] = {"ppi": 72 * _FINE} if form == "png" else {"timestamp": 0}
    made = _compiler()(page, format=form, sys_inputs={"picture": svg}, ignore_system_fonts=True, **further)
    return cast("bytes", made)


@cache
def _compiler() -> Any:
    """Typst's compiler, loaded once per process, so that the time counts for no picture."""
    with uncounted():
        import typst

        return typst.compile
