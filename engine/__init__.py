"""The numerical engine: arrays of parameters in, arrays of characteristics and endings out.

It contains only physics, in SI units and radians, and imports only the standard library, numpy, scipy and numba.
"""

from importlib import import_module
from typing import Any

from sprag_study.engine.endings import Ending
from sprag_study.engine.run import Run, Span

#: Increased whenever a change of the engine can change a stored number.
ENGINE_VERSION = "7"

__all__ = ["ENGINE_VERSION", "Ending", "Run", "Span"]


def __getattr__(name: str) -> Any:
    if name == "simulate":  # with frames, which the engine itself does not know
        return import_module("sprag_study").simulate
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
