"""What the places of specs are called for people: captions instead of JSON Pointers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag.service.languages import _
from sprag.service.reading.phrases import lower_first
from sprag.service.reading.reader import CODES
from sprag.service.results.shown_inputs import part_name, run_name
from sprag.worker.models.vocabulary import has_caption

if TYPE_CHECKING:
    from sprag.service.reading.reader import Reading


def place_text(pointer: str, reading: Reading) -> str:
    """What a JSON Pointer into a spec is called: ``Spring rate, pendulum 0``; ``Run, at most``.

    A path or a result that stands behind the pointer in brackets is what the place is about.
    """
    pointer, _bracket, about = pointer.partition(" (")
    path = about.removesuffix(")") or pointer.removeprefix("/base").strip("/").replace("/", ".")
    if about or (reading.names == CODES and path):
        return reading.caption(path)
    section, _dot, name = path.partition(".")
    if not section:
        return _("Machine") if pointer else _("Spec")
    if section == "run" and pointer.startswith("/run/"):
        return f"{_('Run')}, {lower_first(run_name(name.partition('.')[0]))}"
    return reading.caption(path) if has_caption(reading.model, path) else part_name(path)
