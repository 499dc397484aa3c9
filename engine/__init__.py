"""The numerical engine: arrays of parameters in, arrays of characteristics and endings out.

It knows physics only, in SI units and radians. It imports the standard library, numpy, scipy and numba, nothing else.
"""

from engine.endings import Ending
from engine.run import Run, Span

#: Changes whenever a change of the engine can change a stored number.
ENGINE_VERSION = "3"

__all__ = ["ENGINE_VERSION", "Ending", "Run", "Span"]
