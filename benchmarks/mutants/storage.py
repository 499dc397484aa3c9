"""Mutants of what keeps rows and studies: storage, dispatcher, service."""

from __future__ import annotations

from typing import Final

from benchmarks.mutants.mutant import Mutant

_FAULTS = "tests/acceptance/test_faults.py::"
_KILLS = "tests/acceptance/test_kills.py::"
_GROUPS = "tests/contract/test_groups.py::"
_ROUNDS = "tests/contract/test_rounds.py::"

STORAGE: Final = (
    Mutant(
        "no epoch check",
        "service/storage/work/dispatchers.py",
        'where(DISPATCHERS.c.epoch == sa.bindparam("epoch"), _ALIVE)',
        'where(DISPATCHERS.c.epoch == sa.bindparam("epoch"))',
        ("tests/contract/test_dispatchers.py",),
    ),
    Mutant(
        "claims of ended dispatchers are not returned",
        "service/storage/work/dispatchers.py",
        "CLAIMED, CHUNKS.c.epoch.not_in(present)",
        "CLAIMED, CHUNKS.c.epoch < 0",
        (f"{_KILLS}test_killed_processes_lose_nothing",),
    ),
    Mutant(
        "studies of ended dispatchers are not free",
        "service/storage/work/dispatchers.py",
        "free = STUDIES.c.dispatcher.not_in(present)",
        "free = STUDIES.c.dispatcher < 0",
        ("tests/contract/test_dispatchers.py",),
    ),
    Mutant(
        "a study is taken from another dispatcher",
        "service/storage/work/dispatchers.py",
        "return connection.execute(query).scalar_one_or_none() == epoch",
        "return connection.execute(query).scalar_one_or_none() is not None",
        ("tests/contract/test_dispatchers.py",),
    ),
    Mutant(
        "chunks of another dispatcher's study are claimed",
        "service/storage/work/work.py",
        'sa.func.coalesce(STUDIES.c.dispatcher, sa.bindparam("epoch")) == sa.bindparam("epoch"),',
        'sa.bindparam("epoch", type_=sa.Integer) > 0,',
        ("tests/contract/test_dispatchers.py",),
    ),
    Mutant(
        "every dispatcher keeps a new study for itself",
        "worker/sharing.py",
        "and all(peer.studies >= studies for peer in peers)",
        "",
        ("tests/worker/test_sharing.py",),
    ),
    Mutant(
        "a study with rows goes to any fingerprint",
        "worker/sharing.py",
        "        if fingerprint != study.fingerprint and alike:",
        "        if fingerprint != study.fingerprint and not peers:",
        ("tests/worker/test_sharing.py",),
    ),
    Mutant(
        "no IMMEDIATE transaction",
        "service/storage/database/session.py",
        '"write": "BEGIN IMMEDIATE"',
        '"write": "BEGIN"',
        (f"{_FAULTS}test_clients_do_not_hear_of_locks", "tests/contract/test_concurrency.py"),
    ),
    Mutant(
        "no FULL synchronisation",
        "service/storage/database/sqlite_files.py",
        '"synchronous = FULL"',
        '"synchronous = NORMAL"',
        (f"{_FAULTS}test_a_power_cut_takes_nothing_that_was_acknowledged",),
    ),
    Mutant(
        "rows and the chunk's end in two transactions",
        "service/storage/work/work.py",
        "        gains = {number: _Gain() for number in kinds}",
        '        connection.exec_driver_sql("COMMIT")\n        connection.exec_driver_sql("BEGIN IMMEDIATE")\n'
        "        gains = {number: _Gain() for number in kinds}",
        (f"{_FAULTS}test_a_power_cut_takes_nothing_that_was_acknowledged",),
    ),
    Mutant(
        "a chunk that is not claimed by us is stored with its group",
        "service/storage/work/work.py",
        "                    stored = [item for item in left if key_of(item.chunk) in ours]",
        "                    stored = left if ours else []",
        (f"{_GROUPS}test_a_chunk_that_is_not_ours_is_left_out_of_its_group",),
    ),
    Mutant(
        "a chunk is claimed that was divided meanwhile",
        "service/storage/work/chunks.py",
        "    } & keys",
        "    } and keys",
        (f"{_GROUPS}test_a_chunk_that_is_not_ours_is_left_out_of_its_group",),
    ),
    Mutant(
        "a group is stored without a check of its epoch",
        "service/storage/work/work.py",
        "                    require_epoch(connection, epoch)\n                    ours",
        "                    ours",
        (f"{_GROUPS}test_a_group_that_cannot_be_stored_changes_nothing",),
    ),
    Mutant(
        "only the last chunk of a group is counted",
        "service/storage/work/work.py",
        "            gain.cases += chunk.count",
        "            gain.cases = chunk.count",
        (f"{_GROUPS}test_chunks_of_several_studies_are_stored_and_counted_together",),
    ),
    Mutant(
        "a study ends before its last group is stored",
        "worker/dispatcher.py",
        "            return\n        self._exchange()\n        match instruction:",
        "            return\n        match instruction:",
        ("tests/worker/test_dispatcher.py::test_the_log_tells_when_a_study_is_taken_up_and_how_it_ends",),
    ),
    Mutant(
        "a round and its chunks in two transactions",
        "service/storage/work/work.py",
        "            chunks = [Chunk(number, first + start, size) for start, size in sizes]",
        '            connection.exec_driver_sql("COMMIT")\n            connection.exec_driver_sql("BEGIN")\n'
        "            chunks = [Chunk(number, first + start, size) for start, size in sizes]",
        (f"{_ROUNDS}test_a_round_that_breaks_off_changes_nothing",),
    ),
    Mutant(
        "a round is appended twice",
        "service/storage/work/work.py",
        "    return row.done == row.cases and cases in {None, row.cases}",
        "    return bool(row.done == row.cases)",
        (f"{_ROUNDS}test_a_round_is_appended_once_and_only_while_the_study_is_going",),
    ),
    Mutant(
        "a round is appended before its predecessor is complete",
        "service/storage/work/work.py",
        "    return row.done == row.cases and cases in {None, row.cases}",
        "    return cases in {None, row.cases}",
        (f"{_ROUNDS}test_a_round_is_appended_once_and_only_while_the_study_is_going",),
    ),
    Mutant(
        "a held study gets its next round",
        "service/storage/work/work.py",
        "    if row is None or row.most_cases is None or not StudyState(row.state).going:",
        "    if row is None or row.most_cases is None or StudyState(row.state).terminal:",
        (f"{_ROUNDS}test_a_round_is_appended_once_and_only_while_the_study_is_going",),
    ),
    Mutant(
        "a study ends between its rounds",
        "service/storage/work/work.py",
        "            goes_on = most_cases is not None and summary is None",
        "            goes_on = False",
        (f"{_ROUNDS}test_a_study_with_rounds_is_not_ended_between_them",),
    ),
    Mutant(
        "no quarantine",
        "worker/dispatch.py",
        "            known.suspects.append(Quarantine(chunk, WorkerEnding.CRASHED, event.detail))\n"
        "            return []",
        "            known.waiting.appendleft(chunk)\n            return [PutBack(chunk, event.detail)]",
        ("tests/worker/test_dispatch.py::test_one_success_forgives_the_crashes_before_it",),
    ),
    Mutant(
        "a broken engine is the cases' fault",
        "worker/dispatch.py",
        "            if disjoint(known.crashed) >= FAULT_CRASHES:",
        "            if disjoint(known.crashed) >= FAULT_CRASHES and known.proven:",
        ("tests/worker/test_dispatch.py::test_when_everything_crashes_the_study_is_held_and_nobody_blamed",),
    ),
    Mutant(
        "children outlive their parent",
        "worker/pool/processes.py",
        "    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, int(number), 0, 0, 0)\n",
        "    ctypes.CDLL(None, use_errno=True)\n",
        (f"{_KILLS}test_killed_processes_lose_nothing",),
    ),
    Mutant(
        "no reserve for a full disk",
        "service/storage/work/room.py",
        "    if free >= RESERVE_BYTES and not (capped and limit - size - log < RESERVE_BYTES):",
        "    if True:",
        ("tests/service/storage/test_room.py",),
    ),
    Mutant(
        "chunks that split a line",
        "worker/chunking.py",
        "math.ceil(lines / MAX_CHUNKS)) * length",
        "math.ceil(lines / MAX_CHUNKS)) * (length - 1)",
        ("tests/worker/test_sweeps.py::test_a_killed_sweep_goes_on_with_the_same_bits",),
    ),
)
