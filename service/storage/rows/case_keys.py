"""The keys of the cases of studies: equal cases of other studies are found by them, however many studies there are.

They are stored with the study and its rounds, not with the rows. Studies of before revision 0035 get theirs from
`Reuse.key_steps`; until then, and for studies with very many cases, the studies themselves are compared.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Final

import numpy as np
import sqlalchemy as sa

from sprag_study.service.storage.part import MAX_INTEGER
from sprag_study.worker import fingerprint
from sprag_study.worker.case_keys import case_keys

if TYPE_CHECKING:
    from sprag_study.worker.arrays import Ints
    from sprag_study.worker.study import Study

#: Values of `STUDIES.c.keyed`: not looked at yet, all cases have keys, too many cases for keys.
NOT_YET, KEYED, TOO_MANY = 0, 1, 2
#: Cases above which a study gets no keys, unless it chooses its own cases. Writing this many takes a tenth of a second.
MAX_KEYED: Final = 50_000
#: Keys that are asked for at once, and that are written with one statement.
_ASKED: Final = 20_000
_WRITTEN: Final = 5_000
#: The newest study that has a case of a key and may be read, below a study for each key.
_OLDER: Final = (
    # SQLite takes the tables of a CROSS JOIN in this order, so that it looks up a key instead of going through studies.
    "(SELECT k.study FROM case_keys k CROSS JOIN studies s WHERE k.key = w.key AND k.study < w.below "
    "AND s.number = k.study AND k.study <> :own AND s.done > 0 AND s.deleted_at IS NULL "
    "AND s.fingerprint IN (:print, '') ORDER BY k.study DESC LIMIT 1)"
)
_ADDED: Final = {
    "sqlite": "INSERT OR IGNORE INTO case_keys (key, study) SELECT value, :study FROM json_each(:keys) ORDER BY value",
    "postgresql": "INSERT INTO case_keys (key, study) SELECT CAST(value AS bigint), :study "
    "FROM json_array_elements_text(CAST(:keys AS json)) ON CONFLICT DO NOTHING",
}
_WANTED: Final = {
    "sqlite": "(SELECT json_extract(value, '$[0]') AS place, json_extract(value, '$[1]') AS key, "
    "json_extract(value, '$[2]') AS below FROM json_each(:asked))",
    "postgresql": "(SELECT CAST(value ->> 0 AS integer) AS place, CAST(value ->> 1 AS bigint) AS key, "
    "CAST(value ->> 2 AS integer) AS below FROM json_array_elements(CAST(:asked AS json)))",
}


def keys_of(study: Study, kin: str) -> Ints | None:
    """The keys of a new study of that kin; None where it has too many cases for keys."""
    return None if study.cases > MAX_KEYED and study.plan is None else case_keys(study, kin)


def add_keys(connection: sa.Connection, number: int, keys: Ints) -> None:
    """Store the keys of cases of a study."""
    query = sa.text(_ADDED[connection.dialect.name])
    for first in range(0, keys.size, _WRITTEN):
        connection.execute(query, {"study": number, "keys": json.dumps(keys[first : first + _WRITTEN].tolist())})


def newest_with(connection: sa.Connection, keys: Ints, below: Ints, own: int) -> Ints:
    """For each key the newest study under the number ``below`` it that has rows and a case of this key; 0 for none.

    Only studies with rows that may be reused by this process count, and not the study ``own``.
    """
    found = np.zeros(keys.size, dtype=np.int64)
    query = sa.text(
        f"SELECT place, study FROM (SELECT w.place, {_OLDER} AS study "  # noqa: S608 - constants
        f"FROM {_WANTED[connection.dialect.name]} w) found WHERE study IS NOT NULL"
    )
    for first in range(0, keys.size, _ASKED):
        part = slice(first, first + _ASKED)
        places = range(first, min(first + _ASKED, keys.size))
        asked = json.dumps(list(zip(places, keys[part].tolist(), below[part].tolist(), strict=True)))
        rows = connection.execute(query, {"asked": asked, "own": own, "print": fingerprint.digest()}).all()
        if rows:
            at, studies = np.array(rows, dtype=np.int64).T
            found[at] = studies
    return found


def any_below(size: int) -> Ints:
    """The bounds of `newest_with` that allow every study."""
    return np.full(size, MAX_INTEGER, dtype=np.int64)
