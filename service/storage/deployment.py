"""Which database is the deployment: a copy is recognised by its place, and fires neither schedules nor reports.

A database keeps where it was when it became the deployment: its file, or its number on its server. A copy has what the
original kept and lies elsewhere, so it is off until somebody adopts it (`sprag admin db adopt`).
"""

from __future__ import annotations

import ctypes
import hashlib
import json
import os
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Final

import sqlalchemy as sa

from sprag_study.service.storage.database.sqlite_files import file_system_of
from sprag_study.service.storage.part import Part, SystemClock, micros_of
from sprag_study.service.storage.people.audit import note
from sprag_study.service.storage.schedules.tables import SCHEDULES
from sprag_study.service.storage.tables import METADATA

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sprag_study.service.storage.database.session import Session

    #: What a database is told by, such as {"kind": "file", "number": "42"}.
    Place = Mapping[str, str]

#: One row at most: none where a database never had a schedule.
DEPLOYMENT: Final = sa.Table(
    "deployment",
    METADATA,
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
    # Where it was then, as JSON data.
    sa.Column("place", sa.Text, nullable=False),
    sa.Column("adopted_at", sa.BigInteger, nullable=False),
)

#: Whether there is a schedule, or has been one.
ANY_SCHEDULE: Final = sa.select(sa.exists(sa.select(SCHEDULES.c.number)))

#: File systems that number their files anew whenever they are mounted.
_RENUMBERED: Final = frozenset({"9p", "exfat", "msdos", "vboxsf", "vfat"})
_MACHINE_ID: Final = Path("/etc/machine-id")
#: Where systemd is the first process, the machine has an id for good; those of application containers come and go.
_SYSTEMD: Final = Path("/run/systemd/system")
_CONTAINERS: Final = (Path("/.dockerenv"), Path("/run/.containerenv"))
#: Of Linux's ``statx``: the file of the given name, its time of birth, and where the answer has the mask and that time.
_AT_FDCWD, _BIRTH, _MASK_AT, _BIRTH_AT, _STATX_BYTES = -100, 0x800, 0, 80, 256


class Deployment(Part):
    """Whether this database is the deployment."""

    def is_copy(self) -> bool:
        """Whether this is a copy of the deployment that nobody has adopted."""
        with self.session.read() as connection:
            return _is_copy(self.session, connection)

    def is_deployment(self) -> bool:
        """Whether this is the deployment; it becomes it where nothing was kept yet, as in databases of before."""
        with self.session.read() as connection:
            if (kept := _kept(connection)) is not None:
                return not differs(json.loads(kept), place_of(self.session, connection))
        settle(self.session)
        return True

    def adopt(self) -> bool:
        """Make this database the deployment; whether it was a copy."""
        with self.session.write() as connection:
            copy = _is_copy(self.session, connection)
            connection.execute(sa.delete(DEPLOYMENT))
            _keep(self.session, connection, self._now())
            note(connection, self._now(), "database.adopt", "")
        return copy


def settle(session: Session) -> None:
    """Make a database with schedules the deployment where none was kept yet: before it fires, and before it is copied.

    What has no schedule yet can be copied freely.
    """
    with session.read() as connection:
        wanted = _is_open(connection)
    if wanted:
        with session.write() as connection:
            settle_in(session, connection)


def settle_in(session: Session, connection: sa.Connection) -> None:
    """Do so in a write transaction."""
    if _is_open(connection):
        _keep(session, connection, micros_of(SystemClock().now()))


def _is_open(connection: sa.Connection) -> bool:
    """Whether a database has schedules, and is not known as the deployment or a copy of it."""
    return _kept(connection) is None and bool(connection.execute(ANY_SCHEDULE).scalar_one())


def _kept(connection: sa.Connection) -> str | None:
    text: str | None = connection.execute(sa.select(DEPLOYMENT.c.place)).scalars().first()
    return text


def _keep(session: Session, connection: sa.Connection, now: int) -> None:
    place = json.dumps(place_of(session, connection))
    connection.execute(sa.insert(DEPLOYMENT).values(number=1, place=place, adopted_at=now))


def _is_copy(session: Session, connection: sa.Connection) -> bool:
    text = _kept(connection)
    return text is not None and differs(json.loads(text), place_of(session, connection))


def differs(kept: Place, here: Place) -> bool:
    """Whether two places are not the same; what only one of them knows says nothing."""
    return any(kept[name] != here[name] for name in kept.keys() & here.keys())


def place_of(session: Session, connection: sa.Connection) -> Place:
    """Where a database is."""
    if not session.on_server:
        return place_of_file(session.path)
    name = "SELECT oid::text FROM pg_database WHERE datname = current_database()"
    place = {"kind": "server", "database": str(connection.exec_driver_sql(name).scalar_one())}
    if connection.exec_driver_sql("SELECT has_function_privilege('pg_control_system()', 'EXECUTE')").scalar_one():
        system = "SELECT system_identifier::text FROM pg_control_system()"
        place["system"] = str(connection.exec_driver_sql(system).scalar_one())
    return place


def place_of_file(path: Path) -> Place:
    """Number and birth of a file, as far as its file system keeps them, and its machine."""
    place = {"kind": "file"}
    kind = file_system_of(path)
    if kind not in _RENUMBERED and not kind.startswith("fuse"):
        place["number"] = str(path.stat().st_ino)
    if birth := _birth_of(path):
        place["birth"] = birth
    if machine := _machine():
        place["machine"] = machine
    return place


def _birth_of(path: Path) -> str | None:
    """When a file was created, which no copy takes along; None where nobody knows."""
    answer = ctypes.create_string_buffer(_STATX_BYTES)
    with suppress(AttributeError, OSError):  # another system, or an old library
        library = ctypes.CDLL(None, use_errno=True)
        if library.statx(_AT_FDCWD, os.fsencode(path), 0, _BIRTH, answer) == 0:
            mask = int.from_bytes(answer.raw[_MASK_AT : _MASK_AT + 4], "little")
            seconds = int.from_bytes(answer.raw[_BIRTH_AT : _BIRTH_AT + 8], "little", signed=True)
            nanoseconds = int.from_bytes(answer.raw[_BIRTH_AT + 8 : _BIRTH_AT + 12], "little")
            return f"{seconds}.{nanoseconds:09}" if mask & _BIRTH else None
    return None


def _machine() -> str | None:
    """A digest of the machine's id, which is not for others; None where it has none that lasts."""
    if not _SYSTEMD.is_dir() or any(path.exists() for path in _CONTAINERS) or os.path.ismount(_MACHINE_ID):
        return None
    try:
        text = _MACHINE_ID.read_text(encoding="ascii").strip()
    except (OSError, ValueError):
        return None
    if len(text) != 32:
        return None
    return hashlib.blake2b(text.encode(), key=b"sprag deployment", digest_size=16).hexdigest()
