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
from collections.abc import Iterator
from functools import cache
from importlib.metadata import version
from pathlib import Path

from sprag_study.engine.compile.ways import WAY
from sprag_study.engine.sources import engine_folder, source_hash

#: Environment variable that moves the cache.
CACHE_VARIABLE = "SPRAG_KERNEL_CACHE"
#: The number of users from outside of a user namespace, such as that of a container.
_UNMAPPED = 65_534
_TEMPORARY_NAME = f"sprag-kernels-{os.getuid()}"


@cache
def _engine_hash() -> str:
    sources = source_hash(engine_folder())
    # Whoever only looks for the folder, such as the service, does not load numba for it.
    return hashlib.sha256(f"{version('numba')} {WAY} {sources}".encode()).hexdigest()[:16]


def _usable(folder: Path) -> bool:
    """Whether this process may write into the folder, which is created if missing, and nobody else but root."""
    try:
        for missing in reversed([place for place in (folder, *folder.parents) if not place.exists()]):
            missing.mkdir(mode=0o700, exist_ok=True)
        return os.access(folder, os.W_OK) and is_trusted(folder)
    except OSError:
        return False


def is_trusted(folder: Path) -> bool:
    """Whether nobody but this user and root can change what is in the folder, as its contents are executed.

    Owners and rights of the folder, of its files and of every folder above count, by its name and by the one that
    links lead to. Above it a folder for everybody is allowed where each user's own are safe there (the sticky bit).
    """
    folder = Path(os.path.abspath(folder))
    ways = {place for way in (folder, folder.resolve()) for place in (way, *way.parents)}
    above = (place.lstat() for place in ways if place not in (folder, folder.resolve()))
    if not all(_is_safe(status, sticky=True) for status in above):
        return False
    return all(map(_is_safe, (folder.lstat(), folder.stat(), *_inside(folder))))


def _inside(folder: Path) -> Iterator[os.stat_result]:
    """The status of every file and folder in a folder; other processes may delete some meanwhile."""
    for place, folders, files in os.walk(folder):
        for name in (*folders, *files):
            with contextlib.suppress(FileNotFoundError):
                yield os.lstat(os.path.join(place, name))


def _is_safe(status: os.stat_result, *, sticky: bool = False) -> bool:
    """Whether only this user and root can change a file or folder."""
    if status.st_uid not in (os.getuid(), 0) and not (status.st_uid == _UNMAPPED and _in_user_namespace()):
        return False
    if stat.S_ISLNK(status.st_mode) or (sticky and status.st_mode & stat.S_ISVTX):
        return True
    others = status.st_mode & (stat.S_IWOTH if _is_own_group(status.st_gid) else stat.S_IWOTH | stat.S_IWGRP)
    return not others


@cache
def _in_user_namespace() -> bool:
    """Whether this process sees only some of the machine's users; the others, root too, have one number for it."""
    try:
        return Path("/proc/self/uid_map").read_text(encoding="ascii").split() != ["0", "0", "4294967295"]
    except OSError:
        return False


def _is_own_group(group: int) -> bool:
    """Whether a group is that of this user alone, as many systems give each one; its rights are the user's."""
    if group == 0:
        return True
    import grp
    import pwd

    try:
        found = grp.getgrgid(group)
        user = pwd.getpwuid(os.getuid()).pw_name
    except KeyError:
        return False
    return found.gr_name == user and set(found.gr_mem) <= {user}


@cache
def cache_folder() -> Path:
    """The folder, created if missing: under ``SPRAG_KERNEL_CACHE``, otherwise under the user's cache folder.

    Where that is not writable, or others could change it, it is a private folder under the temporary folder, the same
    for every process.
    """
    chosen = os.environ.get(CACHE_VARIABLE)
    base = os.environ.get("XDG_CACHE_HOME")
    root = Path(chosen) if chosen else (Path(base) if base else Path.home() / ".cache") / "sprag"
    folder = root / "kernels" / _engine_hash()
    return folder if _usable(folder) else _own_temporary_folder()


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
    if not root.is_symlink() and root.is_dir() and _usable(folder := root / _engine_hash()):
        return folder
    return Path(tempfile.mkdtemp(prefix="sprag-kernels-"))
