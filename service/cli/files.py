"""Files that commands read and write; each error is one sentence."""

from __future__ import annotations

import errno
import glob
import os
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import IO, TYPE_CHECKING, Literal, cast

from sprag_study.service.cli.console import CommandFailureError, TroubleError, WrongInputError, wrong_option
from sprag_study.service.cli.table_files import named, with_tables
from sprag_study.service.faults import Fault, Kind
from sprag_study.service.languages import N_, _
from sprag_study.service.presets import preset_names, preset_text
from sprag_study.service.spec.report import SpecError
from sprag_study.service.stale_files import mark, sweep
from sprag_study.service.table_rows import decoded
from sprag_study.worker.limits import MAX_BODY_BYTES

if TYPE_CHECKING:
    from sprag_study.service.spec.document import ParsedSpec
    from sprag_study.worker.study import Study

#: Largest file of measured data: far more rows than any clutch test has.
MAX_DATA_BYTES = 16 * 1024 * 1024
#: Errors of the storage rather than of the given name.
_STORAGE_ERRORS = {errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EROFS}


def file_failure(path: Path | str, error: OSError) -> CommandFailureError:
    """The failure for an operating system error on ``path``."""
    reason = (error.strerror or str(error)).lower()
    if error.errno in _STORAGE_ERRORS:
        return TroubleError("write-failed", f"{path}: {reason}")
    return WrongInputError("invalid-file", f"{path}: {reason}")


def read_bytes(path: str, limit: int) -> bytes:
    """The whole file, or standard input for "-", of at most ``limit`` bytes.

    Raises WrongInputError when there is no such file, it is a directory, cannot be read or is too large.
    """
    with _naming(path):
        if path == "-":
            data = sys.stdin.buffer.read(limit + 1)
        else:
            with Path(path).open("rb") as file:
                data = file.read(limit + 1)
    if len(data) > limit:
        raise WrongInputError(
            "invalid-file", _("{file}: larger than the allowed {limit} bytes", file=path, limit=limit)
        )
    return data


def decode(path: str, data: bytes) -> str:
    """The text of a table: in UTF-8, in UTF-16 with a byte order mark, or in a code page of Windows.

    Raises WrongInputError when it is not text.
    """
    try:
        text = decoded(data)
    except UnicodeDecodeError as error:
        raise WrongInputError(
            "invalid-file",
            _(
                "{file}: not UTF-8 text (byte {place} is {value})",
                file=path,
                place=error.start,
                value=f"{data[error.start]:#04x}",
            ),
        ) from error
    if "\0" in text:
        raise WrongInputError("invalid-file", _("{file}: a binary file, not text", file=path))
    return text


def is_preset(name: str) -> bool:
    """Whether a name stands for a study that comes with the program: there is no file of that name."""
    return name in preset_names() and not Path(name).exists()


def _preset(name: str) -> tuple[str, bytes]:
    file, text = preset_text(name)
    return file, text.encode()


def _format(path: str, data: bytes) -> Literal["json", "toml"]:
    """The format by the ending of the name; where that is unknown, by the first character."""
    suffix = Path(path).suffix.lower()
    if suffix in (".json", ".toml"):
        return "json" if suffix == ".json" else "toml"
    return "json" if data.removeprefix(b"\xef\xbb\xbf").lstrip()[:1] in (b"{", b"[", b"") else "toml"


def read_spec(
    path: str, points: str | None = None, limit: int = MAX_DATA_BYTES, files: Sequence[str] | None = None
) -> object:
    """The plain data of the spec in a JSON or TOML file, of a preset by its name, or of standard input for "-".

    The cases of the CSV file ``points``, if given, replace the spec's axes; it may have ``limit`` bytes. The
    CSV files of ``files`` (``PLACE=FILE``) are tables of the machine. Raises WrongInputError with every problem found.
    """
    from sprag_study.service.client.queries import with_points
    from sprag_study.service.spec.text import load_spec

    tables = named(files or ())

    if path == points == "-":
        raise wrong_option("--points", "conflict", N_("standard input is the spec already"), allowed=_("a file"))
    name, data = (path, read_bytes(path, MAX_BODY_BYTES)) if not is_preset(path) else _preset(path)
    try:
        spec = load_spec(data, _format(name, data))
    except SpecError as error:
        raise spec_failure(path, error) from error
    if tables and isinstance(spec, Mapping):
        spec = with_tables(spec, [(place, decode(name, read_bytes(name, limit))) for place, name in tables])
    if points is None or not isinstance(spec, Mapping):
        return spec
    return with_points(spec, decode(points, read_bytes(points, limit)))


def read_study(
    path: str,
    points: str | None = None,
    change: Callable[[object], object] | None = None,
    files: Sequence[str] | None = None,
) -> ParsedSpec:
    """The checked study of a spec file, with the cases in ``points`` and the tables in ``files`` (see `read_spec`).

    ``change`` completes the spec before it is read further; its SpecError is reported like the others.

    Raises WrongInputError with every problem found.
    """
    from sprag_study.service.spec.document import parse_spec

    data = read_spec(path, points, files=files)
    with naming_points(points):
        try:
            return parse_spec(data if change is None else change(data))
        except SpecError as error:
            raise spec_failure(path, error) from error


def require_cases(study: Study, cases: Iterable[int], most: int | None = None) -> None:
    """Raise WrongInputError for numbers that no case has, of at ``most`` so many; by default, of those of the study."""
    most = study.cases if most is None else most
    allowed = f"0 .. {most - 1}"
    problems = [
        Fault("--case", "unknown-name", N_("there is no such case"), case, allowed) for case in cases if case >= most
    ]
    if problems:
        raise WrongInputError("invalid-parameter", _("invalid option"), problems)


@contextmanager
def naming_points(points: str | None) -> Iterator[None]:
    """Convert faults of axes to faults of the file of points, where the axes come from one."""
    try:
        yield
    except WrongInputError as failure:
        if points is None:
            raise
        lines = [
            replace(fault, where=points) if (fault.where or "").startswith("/axes") else fault
            for fault in failure.faults
        ]
        raise WrongInputError(cast("Kind", failure.code), failure.detail, lines) from failure


def spec_failure(path: str, error: SpecError) -> WrongInputError:
    """The failure for a SpecError: its faults, one per line."""
    return WrongInputError("invalid-spec", _("{file}: the spec is not valid", file=path), error.faults)


Write = Callable[[bytes], None]


@contextmanager
def output(path: str | None) -> Iterator[Write]:
    """A function that writes bytes to standard output (None and "-") or to a file that appears only when complete.

    Whether the file can be written is checked at the start, before anything is computed. Raises WrongInputError or
    TroubleError when it cannot be written.
    """
    if path is None or path == "-":
        sys.stdout.flush()
        yield _writer(sys.stdout.buffer, _("standard output"))
        with _naming(_("standard output")):
            sys.stdout.buffer.flush()
        return
    target = Path(path)
    with _naming(target):
        if target.is_dir():
            raise WrongInputError("invalid-file", _("{file}: is a directory", file=path))
        through = target.exists() and not target.is_file()  # devices and pipes are written to, never replaced
    if through:
        with _naming(target):
            file = target.open("wb")
        with _closed(file, target):
            yield _writer(file, target)
    else:
        yield from _replaced(target)


def to_file(path: str | None) -> bool:
    """Whether `output` writes to a file, so that standard output is free for messages."""
    return path not in (None, "-")


def _replaced(target: Path) -> Iterator[Write]:
    prefix = f".{target.name[:100]}."
    with _naming(target):
        sweep(target.parent.glob(f"{glob.escape(prefix)}*.part"))
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=prefix, suffix=".part")
        mark(handle)
    try:
        file = os.fdopen(handle, "wb")
        with _closed(file, target):
            yield _writer(file, target)
        with _naming(target):
            os.chmod(name, 0o666 & ~_umask())
            os.replace(name, target)
    finally:
        with suppress(FileNotFoundError):
            os.unlink(name)


@contextmanager
def _naming(path: Path | str) -> Iterator[None]:
    """Convert operating system errors to failures that name the file; a closed pipe is not a failure."""
    try:
        yield
    except BrokenPipeError:
        raise
    except OSError as error:
        raise file_failure(path, error) from error
    except ValueError as error:  # a zero byte in the name
        raise WrongInputError("invalid-file", _("{name} is not a file name", name=repr(path))) from error


@contextmanager
def _closed(file: IO[bytes], path: Path) -> Iterator[None]:
    """Close the file at the end and report errors of closing; after a failure, close it silently."""
    try:
        yield
    except BaseException:
        with suppress(OSError):
            file.close()
        raise
    with _naming(path):
        file.close()


def _writer(file: IO[bytes], path: Path | str) -> Write:
    def write(piece: bytes) -> None:
        with _naming(path):
            file.write(piece)

    return write


def _umask() -> int:
    mask = os.umask(0o077)
    os.umask(mask)
    return mask


def write_pieces(path: str | None, pieces: Iterable[bytes]) -> int:
    """Write the pieces to ``path`` (see `output`); the number of bytes."""
    written = 0
    with output(path) as write:
        for piece in pieces:
            write(piece)
            written += len(piece)
    return written
