"""The tables. Times are microseconds since 1970-01-01 UTC; JSON is text, stored exactly as it was given."""

import threading
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Final

import sqlalchemy as sa

from sprag_study.migrations import REVISIONS
from sprag_study.worker import models
from sprag_study.worker.states import TERMINAL, ChunkState

#: Revision of the schema below.
HEAD_REVISION: Final = REVISIONS[-1]

METADATA = sa.MetaData(
    naming_convention={
        "pk": "pk_%(table_name)s",
        "fk": "fk_%(table_name)s_%(column_0_name)s",
        "ix": "ix_%(table_name)s_%(column_0_name)s",
        "uq": "uq_%(table_name)s_%(column_0_name)s",
    }
)

STUDIES = sa.Table(
    "studies",
    METADATA,
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=True),
    sa.Column("id", sa.String(40), nullable=False, unique=True),
    sa.Column("name", sa.Text, nullable=False),
    sa.Column("model", sa.String(40), nullable=False),
    # Variant of the model: studies of one variant share a table of results. Only the model interprets it.
    sa.Column("variant", sa.String(40), nullable=False, server_default=""),
    sa.Column("state", sa.String(12), nullable=False, index=True),
    sa.Column("reason", sa.Text),
    sa.Column("cases", sa.Integer, nullable=False),
    sa.Column("done", sa.Integer, nullable=False),
    sa.Column("ok", sa.Integer, nullable=False),
    sa.Column("chunk_cases", sa.Integer, nullable=False),
    sa.Column("engine_version", sa.String(40), nullable=False),
    sa.Column("physics_hash", sa.String(64), nullable=False),
    sa.Column("spec", sa.Text, nullable=False),
    sa.Column("study", sa.Text, nullable=False),
    sa.Column("warnings", sa.Text, nullable=False),
    sa.Column("revision", sa.Integer, nullable=False),
    sa.Column("created_at", sa.BigInteger, nullable=False),
    sa.Column("started_at", sa.BigInteger),
    sa.Column("finished_at", sa.BigInteger),
    # Set when a study is deleted; after `purge_at` its rows are removed in short transactions, and this row last.
    sa.Column("deleted_at", sa.BigInteger),
    # Among the studies of one owner, the one with the higher priority runs first.
    sa.Column("priority", sa.Integer, nullable=False, server_default="0"),
    # The part of its priority that counts against studies of other owners (`people.pools.rank_of`).
    sa.Column("rank", sa.Integer, nullable=False, server_default="0"),
    # What a paused study waits for (`WAITS_FOR_ROOM` and below); NULL where the user or a fault paused it.
    sa.Column("waits_for", sa.String(12)),
    # Equal for studies that may share cases (`sprag_study.worker.reuse`).
    sa.Column("kin_hash", sa.String(64), nullable=False, server_default=""),
    # Whether its cases are in `CASE_KEYS` (`sprag_study.service.storage.rows.case_keys`).
    sa.Column("keyed", sa.Integer, nullable=False, server_default="0"),
    # 1: every case is run, without reuse of other studies.
    sa.Column("fresh", sa.Integer, nullable=False, server_default="0"),
    # Cases whose rows were copied from other studies.
    sa.Column("reused", sa.Integer, nullable=False, server_default="0"),
    # Deadline at which the study is held; NULL where it has none.
    sa.Column("finish_by", sa.BigInteger),
    # 1: it is run coarse to fine, `LINE_BY_LINE`: line by line; its chunks are ranges of positions in that order
    # (`sprag_study.worker.order`).
    sa.Column("coarse", sa.Integer, nullable=False, server_default="0"),
    # Fingerprint of the processes that computed its rows (`sprag_study.worker.fingerprint`); NULL: no rows yet, "":
    # unknown, or several.
    sa.Column("fingerprint", sa.String(64)),
    # Of a study that chooses its own cases: more cases and rounds than this it never has; NULL for any other.
    sa.Column("most_cases", sa.Integer),
    sa.Column("most_rounds", sa.Integer),
    # Name of the user to whom it belongs; NULL: to nobody, so every designer may change it.
    sa.Column("owner", sa.String(80), index=True),
    # Rough size of its results, for the quota of its owner; NULL: unknown.
    sa.Column("estimated_bytes", sa.BigInteger),
    # What people write about it; tags one after the other, each between line feeds ("" where there are none).
    sa.Column("notes", sa.Text, nullable=False, server_default=""),
    sa.Column("tags", sa.Text, nullable=False, server_default=""),
    # Set while it is kept out of the usual list.
    sa.Column("archived_at", sa.BigInteger),
    # Until then a deleted study can be restored; 0, or NULL in those deleted before revision 0023: its rows are being
    # removed.
    sa.Column("purge_at", sa.BigInteger),
    # Name, tags and notes as they are searched (`sprag_study.service.storage.studies.listing`).
    sa.Column("search", sa.Text, nullable=False, server_default=""),
    # Epoch of the dispatcher to which it belongs; NULL: to none, so any of them may take it.
    sa.Column("dispatcher", sa.Integer),
    # Of its inputs (`sprag_study.service.storage.studies.study_digests`); NULL: from before revision 0039.
    sa.Column("digest", sa.BigInteger),
    # The values of `reason` (`sprag_study.service.storage.stored_sentences`).
    sa.Column("reason_values", sa.Text),
    # The span that submitted it (`sprag_study.worker.traces`); "" where there were no traces.
    sa.Column("trace", sa.String(55), nullable=False, server_default=""),
    sa.Index("ix_studies_kin_hash_keyed", "kin_hash", "keyed"),
    sqlite_autoincrement=True,
)

#: The study is held by the dispatcher while the disk is full.
WAITS_FOR_ROOM = "room"
#: The study is held outside its window.
WAITS_FOR_WINDOW = "window"
#: Held studies that resume by themselves.
GO_ON = frozenset({WAITS_FOR_ROOM, WAITS_FOR_WINDOW})

#: The study is held at its deadline; it does not resume by itself.
HELD_AT_DEADLINE = "deadline"
#: Values of `STUDIES.c.coarse` of studies that are not run in the order of their case numbers.
COARSE_TO_FINE, LINE_BY_LINE = 1, 2

#: Long texts, and what only the storage needs.
_BESIDE = frozenset(
    {"spec", "study", "search", "deleted_at", "kin_hash", "fresh", "fingerprint", "estimated_bytes", "dispatcher"}
    | {"rank", "keyed", "digest", "trace"}
)
#: The columns of a `StudyRecord`.
RECORD_COLUMNS = tuple(column for column in STUDIES.c if column.name not in _BESIDE)

#: Condition: a study has ended.
ENDED = STUDIES.c.state.in_([state.value for state in TERMINAL])

_CHUNK_STATE = sa.Enum(ChunkState, native_enum=False, length=8, values_callable=lambda states: list(map(str, states)))

CHUNKS = sa.Table(
    "chunks",
    METADATA,
    sa.Column("study", sa.Integer, sa.ForeignKey("studies.number"), primary_key=True),
    # Range of case numbers, or of positions in the study's order where it is coarse to fine.
    sa.Column("first", sa.Integer, primary_key=True),
    sa.Column("count", sa.Integer, nullable=False),
    sa.Column("state", _CHUNK_STATE, nullable=False),
    sa.Column("epoch", sa.Integer),
    sa.Column("failures", sa.Integer, nullable=False),
    sa.Column("detail", sa.Text),
    sa.Column("claimed_at", sa.BigInteger),
    sa.Column("finished_at", sa.BigInteger),
    # Host and fingerprint of the process that computed its rows; NULL: no rows yet, or from before revision 0022. Of
    # rows copied from other studies the hosts there, several with commas between them.
    sa.Column("host", sa.String(255)),
    sa.Column("fingerprint", sa.String(64)),
    # Of its rows (`sprag_study.service.storage.rows.digests`); NULL: no rows yet, or from before revision 0036.
    sa.Column("digest", sa.BigInteger),
    sa.Index("ix_chunks_study_state_finished_at", "study", "state", "finished_at"),
    sqlite_with_rowid=False,
)

#: Rounds of the studies that choose their own cases. The last one of a study that has ended has no cases.
ROUNDS = sa.Table(
    "rounds",
    METADATA,
    sa.Column("study", sa.Integer, sa.ForeignKey("studies.number"), primary_key=True),
    sa.Column("round", sa.Integer, primary_key=True),
    sa.Column("first", sa.Integer, nullable=False),
    sa.Column("count", sa.Integer, nullable=False),
    # What the rows of the rounds before it show, as JSON data.
    sa.Column("summary", sa.Text, nullable=False),
    sa.Column("planned_at", sa.BigInteger, nullable=False),
    sqlite_with_rowid=False,
)

#: Numbers of cases of a study by ending, updated with every commit so that reading needs no counting.
ENDINGS = sa.Table(
    "endings",
    METADATA,
    sa.Column("study", sa.Integer, sa.ForeignKey("studies.number"), primary_key=True),
    sa.Column("ending", sa.String(40), primary_key=True),
    sa.Column("cases", sa.Integer, nullable=False),
    sqlite_with_rowid=False,
)

#: Seconds of the stages of studies that are measured (`sprag_study.worker.stages`), added to as they pass, and between
#: which times they lie.
STAGES = sa.Table(
    "stages",
    METADATA,
    sa.Column("study", sa.Integer, sa.ForeignKey("studies.number"), primary_key=True),
    sa.Column("stage", sa.String(12), primary_key=True),
    sa.Column("seconds", sa.Double, nullable=False),
    # NULL: from before revision 0046.
    sa.Column("began_at", sa.BigInteger),
    sa.Column("ended_at", sa.BigInteger),
    sqlite_with_rowid=False,
)

#: Tables with a few rows of each study, besides its saved views.
OF_STUDIES: Final = (ENDINGS, ROUNDS, STAGES)

IDEMPOTENCY_KEYS = sa.Table(
    "idempotency_keys",
    METADATA,
    # Who sent it (`sprag_study.service.actor.share_of`): each has keys of its own; "" for nobody.
    sa.Column("sender", sa.String(90), primary_key=True, server_default=""),
    sa.Column("key", sa.String(255), primary_key=True),
    sa.Column("body_hash", sa.String(64), nullable=False),
    sa.Column("study", sa.Integer, sa.ForeignKey("studies.number"), nullable=False, index=True),
    sa.Column("created_at", sa.BigInteger, nullable=False),
)

#: Starts of dispatchers: those at work, and the last one.
DISPATCHERS = sa.Table(
    "dispatchers",
    METADATA,
    sa.Column("epoch", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("owner", sa.Text, nullable=False),
    # Of its process and its workers (`sprag_study.worker.fingerprint`); "": from before revision 0028.
    sa.Column("fingerprint", sa.String(64), nullable=False),
    sa.Column("started_at", sa.BigInteger, nullable=False),
    sa.Column("heartbeat_at", sa.BigInteger, nullable=False),
    # When it ended or was found to be gone; NULL while it is at work.
    sa.Column("ended_at", sa.BigInteger),
    # The last time at which the clock was trusted, the same in all rows; NULL before the first check.
    sa.Column("clock_at", sa.BigInteger),
    # What it last reported of its workers, as JSON data (`sprag_study.worker.reports`); NULL before its first
    # heartbeat.
    sa.Column("report", sa.Text),
)

#: Keys of cases (`sprag_study.worker.case_keys`) and the studies that have them, whether or not they have been run.
CASE_KEYS = sa.Table(
    "case_keys",
    METADATA,
    sa.Column("key", sa.BigInteger, primary_key=True, autoincrement=False),
    sa.Column("study", sa.Integer, primary_key=True, autoincrement=False),
    sqlite_with_rowid=False,
)

#: What a fingerprint says, by its digest in chunks and dispatchers; none of versions before revision 0031.
FINGERPRINTS = sa.Table(
    "fingerprints",
    METADATA,
    sa.Column("digest", sa.String(64), primary_key=True),
    sa.Column("content", sa.Text, nullable=False),
)

#: Held while a table of results is defined: the first requests of a service ask for the same one at the same time.
_DEFINING = threading.Lock()

#: Columns of a table of results before the results themselves.
KEY_COLUMNS = ("study", "case_number", "ending", "flags")


def results_name(model: str, variant: str) -> str:
    """Name of the table with the results of that variant of ``model``."""
    return "_".join(filter(None, (model, models.table_of(model, variant)))).replace("-", "_")


@cache
def results_table(model: str, variant: str) -> sa.Table:
    """The table with the results of that variant of ``model``: a row for each finished case."""
    return _results(model, variant).table()


@cache
def further_table(model: str, variant: str) -> sa.Table | None:
    """The table with further rows of a case, numbered from 1; None where a case of the variant has one row.

    Its columns are those of `results_table`, which has the row with the number 0.
    """
    further = _further(model, variant)
    return None if further is None else further.table()


@dataclass(frozen=True, slots=True)
class _Rows:
    """A table of rows.

    ``infos`` are its results. ``indexed`` are columns by which cases are counted and selected. ``number`` is the result
    that belongs to its key, None where the case alone is the key.
    """

    name: str
    infos: tuple[models.ResultInfo, ...]
    indexed: tuple[str, ...] = ()
    number: str | None = None

    def table(self) -> sa.Table:
        """Its description, which each process makes once."""
        with _DEFINING:
            if self.name in METADATA.tables:
                return METADATA.tables[self.name]
            results = (
                sa.Column(
                    info.column, sa.Double if info.kind == "real" else sa.Integer, primary_key=info.name == self.number
                )
                for info in self.infos
            )
            indexes = (sa.Index(self._index(column), "study", column, "case_number") for column in self.indexed)
            return sa.Table(
                self.name,
                METADATA,
                sa.Column("study", sa.Integer, sa.ForeignKey("studies.number"), primary_key=True),
                sa.Column("case_number", sa.Integer, primary_key=True),
                sa.Column("ending", sa.String(40), nullable=False),
                sa.Column("flags", sa.Text, nullable=False),
                *results,
                *indexes,
                sqlite_with_rowid=False,
            )

    def _index(self, column: str) -> str:
        return f"ix_{self.name}_{column}"

    def statements(self) -> Iterator[str]:
        """The statements that make it in an SQLite file, as SQLAlchemy writes them of `table`."""
        key = ["study", "case_number", *(info.column for info in self.infos if info.name == self.number)]
        columns = [
            "study INTEGER NOT NULL",
            "case_number INTEGER NOT NULL",
            "ending VARCHAR(40) NOT NULL",
            "flags TEXT NOT NULL",
            *(
                f"{info.column} {'DOUBLE' if info.kind == 'real' else 'INTEGER'}{' NOT NULL' * (info.column in key)}"
                for info in self.infos
            ),
            f"CONSTRAINT pk_{self.name} PRIMARY KEY ({', '.join(key)})",
            f"CONSTRAINT fk_{self.name}_study FOREIGN KEY(study) REFERENCES studies (number)",
        ]
        written = ", \n\t".join(columns)
        yield f"CREATE TABLE {self.name} (\n\t{written}\n)\n WITHOUT ROWID\n\n"
        for column in self.indexed:
            yield f"CREATE INDEX {self._index(column)} ON {self.name} (study, {column}, case_number)"


def _results(model: str, variant: str) -> _Rows:
    infos = models.result_infos(model, models.table_of(model, variant))
    categories = tuple(info.column for info in infos if info.kind == "category")
    return _Rows(results_name(model, variant), infos, categories)


def _further(model: str, variant: str) -> _Rows | None:
    numbered = models.numbered_by(model, variant)
    if numbered is None:
        return None
    return _Rows(f"{results_name(model, variant)}_more", models.result_infos(model, variant), number=numbered)


def make_tables_of_file(connection: sa.Connection) -> None:
    """Make all tables in an empty SQLite file.

    `all_tables` describes thousands of columns of results, which takes most of a second, and a process needs few of
    them: the tables of rows are made by their text.
    """
    rows: dict[str, _Rows] = {}
    for model in models.model_names():
        for variant in models.variants(model):
            for each in (_results(model, variant), _further(model, variant)):
                if each is not None:
                    rows.setdefault(each.name, each)
    others = [table for table in METADATA.sorted_tables if table.name not in rows]
    METADATA.create_all(connection, others, checkfirst=False)
    for each in rows.values():
        for statement in each.statements():
            connection.exec_driver_sql(statement)


def tables_of_rows(model: str, variant: str) -> list[sa.Table]:
    """The tables with the rows of a study of that variant of ``model``, a row for each case or more."""
    further = further_table(model, variant)
    return [results_table(model, variant), *([] if further is None else [further])]


def all_tables() -> sa.MetaData:
    """The metadata with the results tables of every variant of every model."""
    for model in models.model_names():
        for variant in models.variants(model):
            results_table(model, variant)
            further_table(model, variant)
    return METADATA
