"""A hash of source files, which identifies the code of a process and its compiled code."""

import hashlib
from pathlib import Path


def source_hash(*folders: Path) -> str:
    """SHA-256 (hexadecimal) of the names and contents of all Python files below ``folders``."""
    digest = hashlib.sha256()
    for folder in folders:
        for path in sorted(folder.rglob("*.py")):
            digest.update(path.relative_to(folder).as_posix().encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()


def engine_folder() -> Path:
    """Folder of the engine's source files."""
    return Path(__file__).parent
