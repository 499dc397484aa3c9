"""Where numba keeps the machine code of a function of the engine: by the function's place in the engine.

numba names the folder by the absolute path of the source file, so that each installation of the same engine (another
environment, a new folder for each release, a container) compiled every kernel anew. The cache's folder is named by a
hash of the engine's sources already (`cache`), and numba compares the hash of the source file.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.core.caching import UserProvidedCacheLocator

from sprag_study.engine.compile.cache import cache_folder
from sprag_study.engine.sources import engine_folder

_ENSURED: set[str] = set()


class EngineCacheLocator(UserProvidedCacheLocator):
    """The folder of a function of the engine; numba asks the next class for functions of others."""

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        super().__init__(function, file)  # type: ignore[no-untyped-call]
        place = Path(file).parent.relative_to(engine_folder())
        self._cache_path = os.path.join(cache_folder(), "-".join(("engine", *place.parts)))

    def ensure_cache_path(self) -> None:
        """Create the folder, and raise OSError where it cannot be written to: once for all functions of a folder."""
        if self._cache_path not in _ENSURED:
            super().ensure_cache_path()  # type: ignore[no-untyped-call]
            _ENSURED.add(self._cache_path)

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> Any:
        """The locator, or None for a function that is not part of the engine or a folder that is not writable."""
        if not Path(py_file).is_relative_to(engine_folder()):
            return None
        return super().from_function(py_func, py_file)  # type: ignore[no-untyped-call]


def use_cache() -> None:
    """Make numba keep compiled code in the engine's cache; called before each function is decorated.

    A compilation resets all of numba's settings when a variable ``NUMBA_...`` of the environment has changed, as a pool
    of processes changes one. Functions decorated after that, such as those of the next kernel, would be compiled again
    in other folders.
    """
    own = f"{__name__}.{EngineCacheLocator.__name__}"
    for name, value in (
        ("CACHE_DIR", str(cache_folder())),
        ("CACHE_LOCATOR_CLASSES", f"{own},{UserProvidedCacheLocator.__name__}"),
    ):
        setattr(numba.config, name, value)  # numba does not declare its settings
