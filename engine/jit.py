"""The one door to numba: a decorator that keeps the signature for the type checker."""

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

import numba

from engine.cache import cache_folder

setattr(numba.config, "CACHE_DIR", str(cache_folder()))  # noqa: B010  (numba does not declare it)

P = ParamSpec("P")
R = TypeVar("R")


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile ``function`` on first call and keep the machine code in numba's on-disk cache.

    Division by zero gives infinities as in numpy. Products and sums may be contracted into fused multiply-adds, but are
    never reordered: results do not depend on how a batch is cut.
    """
    jitted = numba.njit(cache=True, error_model="numpy", fastmath={"contract"})(function)
    return cast(Callable[P, R], jitted)
