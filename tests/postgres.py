"""A PostgreSQL server of the tests' own: made in a temporary folder, reached by a socket in it, gone at the end."""

from __future__ import annotations

import itertools
import os
import pwd
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

_NAMES = itertools.count(1)


def program(name: str) -> str | None:
    """Path of a program of the server; Debian keeps them out of PATH."""
    found = shutil.which(name)
    versions = sorted(Path("/usr/lib/postgresql").glob(f"*/bin/{name}"), key=lambda path: int(path.parts[-3]))
    return found or (str(versions[-1]) if versions else None)


def missing() -> str | None:
    """Why there can be no server here, as a sentence; None where there can."""
    try:
        import psycopg  # noqa: F401
    except ImportError:
        return "psycopg is not installed: pip install -e '.[dev]'"
    absent = [name for name in ("initdb", "pg_ctl", "postgres") if program(name) is None]
    return f"PostgreSQL's {', '.join(absent)} not found: install the package postgresql" if absent else None


def require() -> None:
    """Skip the test where there can be no server; on the machine that decides, fail it."""
    if reason := missing():
        if os.environ.get("CI"):
            pytest.fail(f"{reason}. Tests with a server may not be skipped here.")
        pytest.skip(reason)


class Server:
    """A server in ``folder``; superuser ``sprag``, no password, no network."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        # The server refuses to run as root.
        self._user = None if os.geteuid() else _somebody()
        if self._user:
            shutil.chown(folder, self._user)
        self._call("initdb", "-D", str(self.data), "-U", "sprag", "-A", "trust", "-E", "UTF8", "--locale=C", "-N")

    @property
    def data(self) -> Path:
        """The folder of the database cluster."""
        return self.folder / "data"

    def start(self, **more: str) -> None:
        """Start it, with settings of one's own where given, and wait until it answers."""
        options = {
            "listen_addresses": "''",
            "unix_socket_directories": str(self.folder),
            "fsync": "off",
            "shared_buffers": "32MB",
            "max_connections": "60",
            "autovacuum": "off",
            **more,
        }
        text = " ".join(f"-c {name}={value}" for name, value in options.items())
        self._call("pg_ctl", "-D", str(self.data), "-l", str(self.folder / "log"), "-o", text, "-w", "start")

    def stop(self, mode: str = "immediate") -> None:
        """Stop it; "immediate" leaves it as a crash would."""
        self._call("pg_ctl", "-D", str(self.data), "-m", mode, "-w", "stop")

    def url(self, database: str) -> str:
        """SQLAlchemy URL of a database."""
        return f"postgresql://sprag@/{database}?host={self.folder}"

    def new_database(self) -> str:
        """Make an empty database and give its name."""
        import psycopg

        name = f"test_{next(_NAMES)}"
        with psycopg.connect(host=str(self.folder), user="sprag", dbname="postgres", autocommit=True) as connection:
            connection.execute(f"CREATE DATABASE {name} TEMPLATE template0".encode())
        return name

    def _call(self, name: str, *arguments: str) -> None:
        found = program(name)
        assert found is not None
        done = subprocess.run(
            [found, *arguments], cwd=self.folder, user=self._user, stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE if name == "initdb" else subprocess.DEVNULL,
            stderr=subprocess.STDOUT if name == "initdb" else subprocess.DEVNULL, timeout=600, check=False,
        )  # fmt: skip
        if done.returncode:
            log = self.folder / "log"
            said = log.read_text(encoding="utf-8") if log.exists() else (done.stdout or b"").decode()
            raise AssertionError(f"{name} failed: {said}")


def empty(url: str) -> None:
    """Take every row out of a database and begin its numbers anew: far quicker than another database."""
    import sqlalchemy as sa

    from sprag_study.service.storage.database.session import Session

    session = Session(url)
    with session.write() as connection:
        tables = set(sa.inspect(connection).get_table_names()) - {"alembic_version"}
        connection.exec_driver_sql(f"TRUNCATE {', '.join(sorted(tables))} RESTART IDENTITY")
    session.close()


def _somebody() -> str:
    names = {entry.pw_name for entry in pwd.getpwall()}
    return "postgres" if "postgres" in names else "nobody"


@contextmanager
def running(**settings: str) -> Iterator[Server]:
    """A server that is started here, with those settings, and stopped at the end."""
    require()
    # The names of sockets are short, those of pytest's folders are not.
    folder = Path(tempfile.mkdtemp(prefix="sprag-pg-"))
    server = None
    try:
        server = Server(folder)
        server.start(**settings)
        yield server
    finally:
        if server is not None and (server.data / "postmaster.pid").exists():
            server.stop()
        shutil.rmtree(folder, ignore_errors=True)
