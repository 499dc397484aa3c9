"""From Python to machine code: the door to numba, whole programs, lane loops, the cache."""
