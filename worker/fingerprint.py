"""What determines the bits of a result besides its parameters: code and libraries of the process.

The kind of processor does not: a case is computed by operations that every processor of an architecture rounds alike
(docs/adr/0031-processors-may-differ.md).

Two processes with the same fingerprint give the same bits for the same case. If a fingerprint differs from the
dispatcher's, a worker of a cluster is refused and a process of the pool exits. Rows are reused only under the
fingerprint with which they were computed.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import textwrap
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Final

from sprag_study.worker import models

_SOURCES: Final = "sources of engine and worker"
#: Name in the fingerprint: distribution.
_PACKAGES: Final = {"sprag": "sprag-study"} | {name: name for name in ("numpy", "numba", "llvmlite", "scipy")}
#: Settings of numba that do not change what its code computes; those of the processor change its speed only.
_NUMBA_HARMLESS: Final = frozenset(
    {
        "NUMBA_CACHE_DIR",
        "NUMBA_NUM_THREADS",
        "NUMBA_CPU_NAME",
        "NUMBA_CPU_FEATURES",
        "NUMBA_ENABLE_AVX",
        "NUMBA_DISABLE_PERFORMANCE_WARNINGS",
    }
)
#: File in the current folder from which numba also reads settings.
_NUMBA_FILE: Final = Path(".numba_config.yaml")
#: Most characters of a value in a sentence; those of earlier versions name every feature of the processor.
_MOST_SHOWN: Final = 160


def _sources() -> str:
    """Of the engine, and of the worker, which decides the parameters of a case: axes, tolerances, derived ones."""
    return models.source_hash(models.engine_folder(), Path(__file__).parent)[:16]


# Hash of the files when this process began to import them: an upgrade changes the files, not the running code.
_AT_START: Final = _sources()


def collect() -> dict[str, str]:
    """The fingerprint of this process, by subject.

    Where the files have changed since the process started, it differs from every other fingerprint.
    """
    now = _sources()
    changed = f", changed to {now} while process {os.getpid()} ran"
    return {
        _SOURCES: _AT_START if now == _AT_START else _AT_START + changed,
        **{name: _version(package) for name, package in _PACKAGES.items()},
        "Python": platform.python_version(),
        "C library": " ".join(platform.libc_ver()),
        "machine": platform.machine(),
        "compiler": models.compiler(),
        "numba settings": _numba_settings(),
    }


def _numba_settings() -> str:
    settings = [
        f"{name}={value}"
        for name, value in sorted(os.environ.items())
        if name.startswith("NUMBA_") and name not in _NUMBA_HARMLESS
    ]
    with suppress(OSError):
        settings.append(f"{_NUMBA_FILE}={hashlib.sha256(_NUMBA_FILE.read_bytes()).hexdigest()[:16]}")
    return " ".join(settings)


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


@cache
def present() -> Mapping[str, str]:
    """The fingerprint of this process, cached at the first call; `collect` computes it anew."""
    return collect()


def digest() -> str:
    """SHA-256 (hexadecimal) of `present`."""
    return digest_of(present())


def digest_of(fingerprint: Mapping[str, str]) -> str:
    """SHA-256 (hexadecimal) of a fingerprint."""
    return hashlib.sha256(text_of(fingerprint).encode()).hexdigest()


def text_of(fingerprint: Mapping[str, str]) -> str:
    """A fingerprint as JSON data, equal for equal ones."""
    return json.dumps(dict(fingerprint), sort_keys=True)


def differences(own: Mapping[str, str], other: object) -> str:
    """The differences of another process from this one, as a clause; "" where there are none.

    ``other`` may be of any type, because it comes from a process with unknown code.
    """
    if not isinstance(other, Mapping):
        return "it runs another version of Sprag, which does not tell its fingerprint"
    found = []
    for subject in dict.fromkeys((*own, *map(str, other))):
        here, there = own.get(subject, "unknown"), str(other.get(subject, "unknown"))
        if here != there:
            found.append(f"{subject}: {_shown(there)} instead of {_shown(here)}")
    return "; ".join(found)


def _shown(value: str) -> str:
    return textwrap.shorten(value, _MOST_SHOWN, placeholder=" …") or "none"


def prepare_as(expected: str) -> None:
    """First task of a pool process: load the engine. It exits where its fingerprint is not ``expected``."""
    _require(expected)
    models.prepare()
    _require(expected)  # the files may have changed while they were loaded


def _require(expected: str) -> None:
    if digest_of(collect()) != expected:
        raise SystemExit(
            "Sprag, a library or the engine's files changed while the worker ran: it must be started again."
        )
