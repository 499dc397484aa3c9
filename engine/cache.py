"""Where generated kernels and all machine code are kept: one per-user folder for each state of the engine's source.

numba notices when the file of a cached function changes, but not when a function it calls does. A folder named by a
hash of all of the engine's sources (and of the compiler's version) makes old code unreachable instead.
"""

import hashlib
import os
import tempfile
from functools import cache
from pathlib import Path

import numba

#: Environment variable that moves the cache.
CACHE_VARIABLE = "SPRAG_KERNEL_CACHE"


@cache
def _engine_hash() -> str:
    digest = hashlib.sha256(numba.__version__.encode())
    root = Path(__file__).parent
    for path in sorted(root.rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK)


@cache
def cache_folder() -> Path:
    """The folder, made if need be: under ``SPRAG_KERNEL_CACHE``, else the user's cache folder, else a temporary one."""
    chosen = os.environ.get(CACHE_VARIABLE)
    base = os.environ.get("XDG_CACHE_HOME")
    root = Path(chosen) if chosen else (Path(base) if base else Path.home() / ".cache") / "sprag"
    folder = root / "kernels" / _engine_hash()
    if not _writable(folder):
        folder = Path(tempfile.mkdtemp(prefix="sprag-kernels-"))
    return folder
