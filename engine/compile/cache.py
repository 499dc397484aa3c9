"""Cache of generated kernels and machine code: one per-user folder for each state of the engine's sources.

numba notices when the file of a cached function changes, but not when a function that it calls does. Therefore the
folder's name is a hash of all of the engine's sources and of the compiler's version and way, which makes old code
unreachable.
"""

import contextlib
import hashlib
import os
import stat
import tempfile
from functools import cache
from importlib.metadata import version
from pathlib import Path

from sprag.engine.compile.ways import WAY
from sprag.engine.sources import engine_folder, source_hash

#: Environment variable that moves the cache.
CACHE_VARIABLE = "SPRAG_KERNEL_CACHE"
_TEMPORARY_NAME = f"sprag-kernels-{os.getuid()}"


@cache
def _engine_hash() -> str:
    sources = source_hash(engine_folder())
    # Whoever only looks for the folder, such as the service, does not load numba for it.
    return hashlib.sha256(f"{version('numba')} {WAY} {sources}".encode()).hexdigest()[:16]


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK)


@cache
def cache_folder() -> Path:
    """The folder, created if missing: under ``SPRAG_KERNEL_CACHE``, otherwise under the user's cache folder.

    Where that is not writable, it is a private folder under the temporary folder, the same for every process.
    """
    chosen = os.environ.get(CACHE_VARIABLE)
    base = os.environ.get("XDG_CACHE_HOME")
    root = Path(chosen) if chosen else (Path(base) if base else Path.home() / ".cache") / "sprag"
    folder = root / "kernels" / _engine_hash()
    return folder if _writable(folder) else _own_temporary_folder()


def discard() -> None:
    """Delete the contents of the cache; they are created again when needed.

    The folders are kept, because other processes may be about to write into them. Files that cannot be deleted are kept
    too.
    """
    for folder, _folders, files in os.walk(cache_folder()):
        for name in files:
            with contextlib.suppress(OSError):
                os.unlink(os.path.join(folder, name))


def is_wanted(folder: Path) -> bool:
    """Whether a cache folder is the configured one, not the substitute for an unwritable one."""
    return not folder.is_relative_to(Path(tempfile.gettempdir()) / _TEMPORARY_NAME)


def _own_temporary_folder() -> Path:
    """A folder that nobody else can write to, because its contents are executed."""
    root = Path(tempfile.gettempdir()) / _TEMPORARY_NAME
    with contextlib.suppress(FileExistsError):
        root.mkdir(mode=0o700)
    status = root.lstat()
    if not stat.S_ISDIR(status.st_mode) or status.st_uid != os.getuid() or status.st_mode & 0o022:
        return Path(tempfile.mkdtemp(prefix="sprag-kernels-"))
    folder = root / _engine_hash()
    folder.mkdir(exist_ok=True)
    return folder
