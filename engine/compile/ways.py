"""The two ways from Python to machine code, and which one this process takes.

``programs`` (``program``, ``lowering``) compiles in seconds and uses what numba does not promise to keep. ``plain``
(``plain``) uses nothing but numba's documented interface, compiles for a minute or more, and gives the same bits: the
reference for the other one, and what is left while a new numba is not supported yet (docs/porting-numba.md).
"""

import os
from typing import Final

#: Environment variable that chooses.
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
