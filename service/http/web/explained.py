"""Which section of the manual explains a field of a form."""

from __future__ import annotations

from typing import Final

from sprag_study.service.spec.fields import base_path
from sprag_study.worker import models

#: Page and heading by the beginning of a pointer into a spec, without numbers; the machine's own are the model's.
_SECTIONS: Final = {
    "/name": "guide#a-new-study",
    "/finish_by": "guide#running",
    "/text": "guide#the-spec",
    "/axes": "guide#axes",
    "/axes/sweep": "sweeps",
    "/columns": "guide#a-new-study",
    "/sample": "sampling",
    "/points": "sampling",
    "/exclude": "sampling",
    "/refine": "guide-refinement#what-to-write",
    "/goal": "guide-goals#what-to-write",
    "/calibrate": "guide-calibration#what-to-write",
    "/tolerances": "guide-tolerances#the-study",
    "/seed": "guide-tolerances#the-study",
    "/draws": "guide-tolerances#the-study",
    "/drives": "guide-tolerances#the-study",
    "/correlations": "tolerances#correlations",
    "/run": "theory#settled-motion",
    "/run/duration": "theory#runs-of-a-given-time",
    "/run/window": "theory#runs-of-a-given-time",
    "/run/reset": "theory#the-automaton",
    "/run/loads": "guide#forces-and-duty-of-every-case",
}


def explained(pointer: str, model: str) -> str:
    """Address of the section that explains a field of a study of ``model``; "" where there is none.

    Parameters
    ----------
    pointer : JSON Pointer of its value in a spec
    """
    if pointer.startswith("/base/"):
        found = models.model_of(model).presentation.explained(base_path(pointer))
        return found and f"/help/{found}"
    parts = [part for part in pointer.split("/") if part and not part.isdigit()]
    for length in range(len(parts), 0, -1):
        if section := _SECTIONS.get("/" + "/".join(parts[:length])):
            return f"/help/{section}"
    return ""
