"""Sprag as a library: a running service, studies run here, the engine (docs/python.md).

    import sprag_study as sprag

    study = sprag.run("study.toml")  # run here; needs sprag-study[server]
    with sprag.Client("http://sprag.example:8000") as client:  # the base installation
        study = client.submit("study.toml").wait()  # the same study, with the same methods

Everything is loaded on first use. Where an extra is missing, `MissingExtraError` names it.
"""

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from sprag_study import engine
    from sprag_study.frames import simulate
    from sprag_study.local import run
    from sprag_study.searches import Search, search
    from sprag_study.service.client import (
        AsyncClient,
        AsyncStudy,
        Client,
        Curves,
        RefusedError,
        ServiceError,
        SpecFileError,
        StatementError,
        Study,
        StudyTimeoutError,
        UnreachableError,
        compare,
        preset,
        sql,
        with_units,
    )
    from sprag_study.service.client.machines import Drive, Shaft
    from sprag_study.service.extras import MissingExtraError
    from sprag_study.service.spec.report import SpecError
    from sprag_study.worker.errors import SpragError
    from sprag_study.worker.ports import ExecutorError, StoreError

    __version__: str

_OF_CLIENT: Final = (
    "AsyncClient",
    "AsyncStudy",
    "Client",
    "Curves",
    "RefusedError",
    "ServiceError",
    "SpecFileError",
    "StatementError",
    "Study",
    "StudyTimeoutError",
    "UnreachableError",
    "compare",
    "preset",
    "sql",
    "with_units",
)
#: What else needs nothing but the base installation, and its modules.
_OF_BASE: Final = {
    "Drive": "sprag_study.service.client.machines",
    "ExecutorError": "sprag_study.worker.ports",
    "MissingExtraError": "sprag_study.service.extras",
    "Shaft": "sprag_study.service.client.machines",
    "SpecError": "sprag_study.service.spec.report",
    "SpragError": "sprag_study.worker.errors",
    "StoreError": "sprag_study.worker.ports",
}
__all__ = [
    "AsyncClient",
    "AsyncStudy",
    "Client",
    "Curves",
    "Drive",
    "ExecutorError",
    "MissingExtraError",
    "RefusedError",
    "Search",
    "ServiceError",
    "Shaft",
    "SpecError",
    "SpecFileError",
    "SpragError",
    "StatementError",
    "StoreError",
    "Study",
    "StudyTimeoutError",
    "UnreachableError",
    "__version__",
    "compare",
    "engine",
    "preset",
    "run",
    "search",
    "simulate",
    "sql",
    "with_units",
]


#: In a checkout, a symbolic link to the folder beside this package; in what is installed, a folder.
_ENGINE: Final = Path(__file__).with_name("engine")
if _ENGINE.is_file():
    raise ImportError(
        f"{_ENGINE} is a text file, not a symbolic link to the folder of that name: this checkout was made without "
        "symbolic links. Check it out again where git makes them (git config core.symlinks true; on Windows in its "
        "developer mode), or install Sprag from a wheel."
    )


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("sprag-study")
    if name in _OF_CLIENT:
        return getattr(import_module("sprag_study.service.client"), name)
    if name in _OF_BASE:
        return getattr(import_module(_OF_BASE[name]), name)
    extras = import_module("sprag_study.service.extras")
    if name == "engine":
        return import_module("sprag_study.engine")
    with extras.naming_extra(f"sprag.{name}"):
        if name == "run":
            return import_module("sprag_study.local").run
        if name in ("Search", "search"):
            return getattr(import_module("sprag_study.searches"), name)
        if name == "simulate":
            return import_module("sprag_study.frames").simulate
    raise AttributeError(f"module 'sprag_study' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
