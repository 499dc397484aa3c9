"""The two ways from Python to machine code, and the choice of this process.

``programs`` (``program``, ``lowering``) compiles in seconds and uses private parts of numba. ``plain`` (``plain``) uses
only numba's documented interface, takes a minute or more, and gives the same bits: it is the reference for the other
way, and the fallback while a new numba version is not supported yet (docs/porting-numba.md).
"""

import os
from typing import Final

#: Environment variable that selects the way.
COMPILER_VARIABLE: Final = "SPRAG_COMPILER"
PROGRAMS, PLAIN = WAYS = ("programs", "plain")
#: Lanes that are always computed together: the doubles of the largest vector.
GROUP: Final = 8


def _chosen() -> str:
    way = os.environ.get(COMPILER_VARIABLE) or PROGRAMS
    if way not in WAYS:
        raise ValueError(f"{COMPILER_VARIABLE} is {way!r}; allowed: {', '.join(WAYS)}")
    return way


#: The way of this process, from its start to its end.
WAY: Final = _chosen()
