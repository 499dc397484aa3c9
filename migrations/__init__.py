"""The way up for databases of earlier revisions, which `sprag admin db upgrade` goes.

A new database is made from the description of the tables (`sprag_study.service.storage.tables`). An earlier one gets
whatever tables, columns and indexes that description has and the database lacks; so a revision that only adds needs
nothing here but its number. A revision that moves, fills or removes something has a step as well. Steps run after the
additions, in the order of their revisions, and name tables by text: a step does the same on the day it is run as on the
day it was written.
"""

from __future__ import annotations

import hashlib
import json
import unicodedata
from typing import TYPE_CHECKING, Final

import sqlalchemy as sa

if TYPE_CHECKING:
    from collections.abc import Callable

#: Every revision that a database can have, oldest first. The last one is that of this program.
REVISIONS: Final = ("0001", *(f"{number:04}" for number in (*range(3, 48), 50, 53, 55, 56, 57)))


def bring_up(connection: sa.Connection, described: sa.MetaData, before: str) -> None:
    """Turn a database of the revision ``before`` into one of the last revision, in the connection's transaction."""
    if before < "0033":
        _set_keys_aside(connection)
    _add(connection, described)
    for revision, step in _STEPS.items():
        if before < revision:
            step(connection)


def _add(connection: sa.Connection, described: sa.MetaData) -> None:
    """Add the tables, columns and indexes that the database lacks."""
    there, dialect = sa.inspect(connection), connection.dialect
    columns, indexes = there.get_multi_columns(), there.get_multi_indexes()
    for table in described.sorted_tables:
        if (None, table.name) not in columns:
            table.create(connection)
            continue
        known = {column["name"] for column in columns[None, table.name]}
        missing = [column for column in table.columns if column.name not in known]
        if missing and _can_be_made_anew(connection, table):
            table.drop(connection)
            table.create(connection)
            continue
        added = [f"ADD COLUMN {sa.schema.CreateColumn(column).compile(dialect=dialect)}" for column in missing]
        if added and dialect.name != "sqlite":  # which adds one at a time
            added = [", ".join(added)]
        for text in added:
            connection.exec_driver_sql(f"ALTER TABLE {table.name} {text}")
        indexed = {index["name"] for index in indexes[None, table.name]}
        for index in table.indexes:
            if index.name not in indexed:
                index.create(connection)


def _can_be_made_anew(connection: sa.Connection, table: sa.Table) -> bool:
    """Whether a table of rows has none: SQLite reads all tables again after each of a hundred columns added to it."""
    if connection.dialect.name != "sqlite" or "case_number" not in table.c:
        return False
    return connection.execute(sa.select(sa.literal(1)).select_from(table).limit(1)).first() is None


def _hash_kin(connection: sa.Connection) -> None:
    """0004: studies have the hash that those with a common case share."""
    engines = connection.execute(sa.text("SELECT number, engine_version FROM studies")).all()
    for number, engine in engines:
        study = json.loads(_text(connection, "studies", "study", number))
        paths = sorted({*study["base"], *(path for axis in study["axes"] for path in axis["paths"])})
        content = json.dumps(
            {"engine": engine, "model": study["model"], "run": study["run"], "paths": paths},
            sort_keys=True,
            separators=(",", ":"),
            allow_nan=False,
        )
        _set(connection, "studies", number, kin_hash=hashlib.sha256(content.encode("ascii")).hexdigest())


def _leave_fingerprints_unknown(connection: sa.Connection) -> None:
    """0010: nobody knows which code computed the rows that are there, so other studies do not reuse them."""
    connection.execute(sa.text("UPDATE studies SET fingerprint = '' WHERE done > 0"))


def _name_variants(connection: sa.Connection) -> None:
    """0013: the number of pendulums, which only one model has, became the variant of the study's model."""
    connection.execute(sa.text("UPDATE studies SET variant = CAST(pendulums AS VARCHAR(40)) WHERE pendulums > 0"))
    connection.execute(sa.text("ALTER TABLE studies DROP COLUMN pendulums"))


def _give_durations(connection: sa.Connection) -> None:
    """0014: a run without duration and window lasted 60 periods; now it lasts until its motion is settled."""
    for table in ("studies", "schedules"):
        for number in connection.execute(sa.text(f"SELECT number FROM {table}")).scalars().all():  # noqa: S608
            spec = json.loads(_text(connection, table, "spec", number))
            if not isinstance(spec, dict) or spec.get("model") != "vibration-drive":
                continue
            run = spec.get("run", {})
            if isinstance(run, dict) and "duration" not in run and "window" not in run:
                spec["run"] = {"duration": "60 periods", **run}
                _set(connection, table, number, spec=json.dumps(spec))


def _conclude_runs(connection: sa.Connection) -> None:
    """0025: due times that are over have no outcome. Counting the flags of all studies would take long."""
    connection.execute(
        sa.text(
            "UPDATE schedule_runs SET concluded_at = begun_at WHERE state <> 'taken' AND (study IS NULL OR study IN "
            "(SELECT number FROM studies WHERE state IN ('finished', 'failed', 'cancelled') OR waits_for = 'deadline'))"
        )
    )


def _fold_names(connection: sa.Connection) -> None:
    """0026: studies are searched in their texts without case and accents. Earlier ones have no notes and tags."""
    for number, name in connection.execute(sa.text("SELECT number, name FROM studies")).all():
        plain = "".join(sign for sign in unicodedata.normalize("NFKD", name) if not unicodedata.combining(sign))
        _set(connection, "studies", number, search=f"{' '.join(plain.casefold().split())}\n\n")


def _move_dispatcher(connection: sa.Connection) -> None:
    """0028: there are several dispatchers."""
    there = {column["name"] for column in sa.inspect(connection).get_columns("dispatcher")}
    kept = ", ".join(["epoch", "owner", "started_at", "heartbeat_at", *sorted({"clock_at", "report"} & there)])
    connection.execute(
        sa.text(f"INSERT INTO dispatchers ({kept}, fingerprint) SELECT {kept}, '' FROM dispatcher")  # noqa: S608
    )
    connection.execute(sa.text("DROP TABLE dispatcher"))


def _set_keys_aside(connection: sa.Connection) -> None:
    connection.execute(sa.text("CREATE TABLE idempotency_keys_before AS SELECT * FROM idempotency_keys"))
    connection.execute(sa.text("DROP TABLE idempotency_keys"))


def _give_keys_to_senders(connection: sa.Connection) -> None:
    """0033: keys go to the owner of their study or schedule; without one they stay keys of nobody."""
    connection.execute(
        sa.text(
            "INSERT INTO idempotency_keys (sender, key, body_hash, study, created_at) "
            "SELECT CASE WHEN studies.owner IS NULL THEN '' ELSE 'user ' || studies.owner END, "
            "old.key, old.body_hash, old.study, old.created_at "
            "FROM idempotency_keys_before old JOIN studies ON studies.number = old.study"
        )
    )
    connection.execute(sa.text("DROP TABLE idempotency_keys_before"))
    connection.execute(sa.text("UPDATE schedules SET sender = 'user ' || owner WHERE owner IS NOT NULL"))
    connection.execute(sa.text("DROP INDEX IF EXISTS ix_schedules_idempotency_key"))


def _keep_ranks(connection: sa.Connection) -> None:
    """0034: the whole priority of earlier studies counts against studies of other owners."""
    connection.execute(sa.text("UPDATE studies SET rank = priority"))


def _drop_index_of_kin(connection: sa.Connection) -> None:
    """0035: another index begins with the same column."""
    connection.execute(sa.text("DROP INDEX IF EXISTS ix_studies_kin_hash"))


def _let_reports_be_of_no_schedule(connection: sa.Connection) -> None:
    """0041: alerts are reports without a schedule."""
    there = {column["name"]: column for column in sa.inspect(connection).get_columns("reports")}
    if there["schedule"]["nullable"]:
        return
    if connection.dialect.name == "postgresql":
        connection.exec_driver_sql("ALTER TABLE reports ALTER COLUMN schedule DROP NOT NULL")
        return
    # SQLite changes no column: the table is made anew by its own statement.
    made = "SELECT sql FROM sqlite_master WHERE name = 'reports'"
    indexes = "SELECT sql FROM sqlite_master WHERE type = 'index' AND tbl_name = 'reports' AND sql IS NOT NULL"
    statement: str = connection.exec_driver_sql(made).scalar_one()
    again = connection.exec_driver_sql(indexes).scalars().all()
    last = connection.exec_driver_sql("SELECT seq FROM sqlite_sequence WHERE name = 'reports'").scalar()
    other = statement.replace("TABLE reports", "TABLE reports_now", 1)
    connection.exec_driver_sql(other.replace("schedule INTEGER NOT NULL", "schedule INTEGER", 1))
    names = ", ".join(there)
    connection.exec_driver_sql(f"INSERT INTO reports_now ({names}) SELECT {names} FROM reports")  # noqa: S608
    connection.exec_driver_sql("DROP TABLE reports")
    connection.exec_driver_sql("ALTER TABLE reports_now RENAME TO reports")
    for text in again:
        connection.exec_driver_sql(text)
    if last is not None:  # numbers are never given twice
        connection.execute(sa.text("DELETE FROM sqlite_sequence WHERE name = 'reports'"))
        connection.execute(sa.text("INSERT INTO sqlite_sequence (name, seq) VALUES ('reports', :last)"), {"last": last})


def _text(connection: sa.Connection, table: str, name: str, number: int) -> str:
    """A text of a row. One at a time: that of a study can have megabytes."""
    rows = sa.table(table, sa.column("number"), sa.column(name))
    text: str = connection.execute(sa.select(rows.c[name]).where(rows.c.number == number)).scalar_one()
    return text


def _set(connection: sa.Connection, table: str, number: int, **values: str) -> None:
    rows = sa.table(table, sa.column("number"), *map(sa.column, values))
    connection.execute(sa.update(rows).where(rows.c.number == number).values(**values))


#: What is to be done for databases from before a revision.
_STEPS: Final[dict[str, Callable[[sa.Connection], None]]] = {
    "0004": _hash_kin,
    "0010": _leave_fingerprints_unknown,
    "0013": _name_variants,
    "0014": _give_durations,
    "0025": _conclude_runs,
    "0026": _fold_names,
    "0028": _move_dispatcher,
    "0033": _give_keys_to_senders,
    "0034": _keep_ranks,
    "0035": _drop_index_of_kin,
    "0041": _let_reports_be_of_no_schedule,
}
