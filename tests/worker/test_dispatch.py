"""The state machine of dispatch: every case ends exactly once, and the right one gets the blame."""

from __future__ import annotations

from collections import Counter, deque
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sprag_study.worker.dispatch import (
    Broken,
    Cancelled,
    Dispatch,
    Ended,
    Fault,
    Instruction,
    Lost,
    Offered,
    Paused,
    PutBack,
    Refused,
    Renew,
    Run,
    Settle,
    Split,
    Stop,
    disjoint,
    pieces,
)
from sprag_study.worker.ports import Chunk, Fate
from tests.worker.world import World


@given(
    capacity=st.integers(1, 6),
    sizes=st.lists(st.tuples(st.integers(1, 60), st.integers(1, 20)), min_size=1, max_size=3),
    bad=st.sets(st.tuples(st.integers(0, 2), st.integers(0, 59)), max_size=2),
    hanging=st.sets(st.tuples(st.integers(0, 2), st.integers(0, 59)), max_size=6),
    random=st.randoms(use_true_random=False),
)
def test_every_case_ends_exactly_once_and_the_bad_ones_are_named(
    capacity: int,
    sizes: list[tuple[int, int]],
    bad: set[tuple[int, int]],
    hanging: set[tuple[int, int]],
    random: Random,
) -> None:
    world = World(capacity, crash=bad, hang=hanging - bad)
    for study, (cases, size) in enumerate(sizes):
        world.submit(study, cases, size)
    world.run(random)
    expected = {}
    for study, (cases, _) in enumerate(sizes):
        for case in range(cases):
            key = (study, case)
            expected[key] = "crashed" if key in bad else "timed_out" if key in hanging else "ok"
    assert world.rows == expected
    assert sorted(world.settled) == list(range(len(sizes)))
    assert not world.faults
    # Two that crash cannot be told from a broken engine when nothing else of the study came through.
    alone = {number for number, (cases, _) in enumerate(sizes) if {(number, case) for case in range(cases)} <= bad}
    assert set(world.renewed) == alone
    assert world.most_flying <= capacity
    assert world.machine.in_flight == 0
    assert not world.machine.studies


@given(
    capacity=st.integers(1, 6),
    cases=st.integers(1, 60),
    size=st.integers(1, 20),
    kills=st.integers(0, 12),
    random=st.randoms(use_true_random=False),
)
def test_random_deaths_pauses_and_refusals_lose_and_double_nothing(
    capacity: int, cases: int, size: int, kills: int, random: Random
) -> None:
    world = World(capacity)
    world.submit(0, cases, size)
    while not world.settled:
        action = random.choice(["finish", "finish", "kill", "pause", "refuse", "offer", "stop"])
        world.refusing = action == "refuse"
        if action == "pause":
            world.send(Paused(0))
        elif action == "offer" or not world.flying:
            world.offer(0)
        elif action == "kill" and kills:
            kills -= 1
            world.finish(random.choice(sorted(world.flying)), Fate.CRASHED)
        elif action == "stop":
            world.finish(random.choice(sorted(world.flying)), Fate.STOPPED)
        else:
            world.finish(random.choice(sorted(world.flying)))
        if 0 in world.faults:
            world.faults.clear()
            world.flying.clear()
            world.refusing = False
            world.machine = Dispatch(capacity)
            world.offer(0)
    world.refusing = False
    assert sorted(world.rows) == [(0, case) for case in range(cases)]


@given(capacity=st.integers(1, 8), cases=st.integers(3, 200), size=st.integers(1, 64), random=st.randoms())
def test_when_everything_crashes_the_study_is_held_and_nobody_blamed(
    capacity: int, cases: int, size: int, random: Random
) -> None:
    world = World(capacity, crash={(0, case) for case in range(cases)})
    world.submit(0, cases, size)
    world.run(random)
    assert not world.rows
    assert "engine fault" in world.faults[0]
    assert world.renewed == [0]
    assert not world.settled
    assert 0 not in world.machine.studies
    open_cases = sorted(case for chunk in world.waiting[0] for case in range(chunk.first, chunk.last + 1))
    assert open_cases == list(range(cases))


@given(capacity=st.integers(1, 8), cases=st.integers(1, 200), size=st.integers(1, 64), random=st.randoms())
def test_new_kernels_mend_what_broken_ones_did_without_a_trace(
    capacity: int, cases: int, size: int, random: Random
) -> None:
    world = World(capacity, crash={(0, case) for case in range(cases)})
    world.submit(0, cases, size)
    while not world.renewed:
        world.finish(random.choice(sorted(world.flying)))
    world.crash.clear()
    world.run(random)
    assert world.rows == {(0, case): "ok" for case in range(cases)}
    assert world.settled == world.renewed == [0]
    assert not world.faults


def test_a_kernel_that_cannot_be_had_is_compiled_anew_before_its_study_is_held() -> None:
    machine = Dispatch(1)
    machine.handle(Offered(1, [Chunk(1, 0, 4)]))
    assert machine.handle(Broken(2, "no")) == [Stop(1), Renew(2, "no")]
    assert machine.in_flight == 0
    assert machine.handle(Broken(2, "no")) == [Fault(2, "no")]
    assert machine.handle(Broken(2, "no")) == [Renew(2, "no")]


@given(
    capacity=st.integers(1, 6),
    cases=st.integers(1, 60),
    size=st.integers(1, 20),
    after=st.integers(0, 8),
    random=st.randoms(use_true_random=False),
)
def test_what_the_store_could_not_take_is_run_again_and_nothing_twice(
    capacity: int, cases: int, size: int, after: int, random: Random
) -> None:
    world = World(capacity)
    world.submit(0, cases, size)
    for _ in range(after):
        if world.flying:
            world.finish(random.choice(sorted(world.flying)))
    late = dict(world.flying)
    world.send(Lost())
    assert world.stopping == set(late)
    world.flying.clear()
    world.waiting[0] |= world.claimed[0]
    world.claimed[0].clear()
    if not world.settled:
        world.offer(0)
    for ticket in late:
        assert world.machine.handle(Ended(ticket, Fate.DONE)) == []
    world.run(random)
    assert sorted(world.rows) == [(0, case) for case in range(cases)]
    assert world.settled == [0]


@given(
    capacity=st.integers(1, 6),
    priorities=st.lists(st.integers(-2, 2), min_size=2, max_size=4),
    random=st.randoms(use_true_random=False),
)
def test_no_study_starts_a_chunk_while_one_of_higher_priority_waits(
    capacity: int, priorities: list[int], random: Random
) -> None:
    machine = Dispatch(capacity)
    left = {study: [Chunk(study, first, 4) for first in range(0, 40, 4)] for study in range(len(priorities))}
    chunks = {study: list(waiting) for study, waiting in left.items()}
    flying: list[int] = []

    def follow(instructions: list[Instruction]) -> None:
        for instruction in instructions:
            if isinstance(instruction, Run):
                started = instruction.chunk.study
                offered_above = [s for s in offered if priorities[s] > priorities[started] and left[s]]
                assert not offered_above
                left[started].remove(instruction.chunk)
                flying.append(instruction.ticket)

    offered: list[int] = []
    for study in random.sample(sorted(chunks), len(chunks)):
        offered.append(study)
        follow(machine.handle(Offered(study, chunks[study], priorities[study])))
    while flying:
        follow(machine.handle(Ended(flying.pop(random.randrange(len(flying))), Fate.DONE)))
    assert not any(left.values())


@given(
    capacity=st.integers(1, 6),
    sizes=st.lists(st.tuples(st.integers(1, 60), st.integers(1, 20)), min_size=2, max_size=3),
    after=st.integers(0, 8),
    random=st.randoms(use_true_random=False),
)
def test_cancelling_keeps_what_is_done_and_starts_nothing_more(
    capacity: int, sizes: list[tuple[int, int]], after: int, random: Random
) -> None:
    world = World(capacity)
    for study, (cases, size) in enumerate(sizes):
        world.submit(study, cases, size)
    for _ in range(after):
        if world.flying:
            world.finish(random.choice(sorted(world.flying)))
    cancelled = 0 not in world.settled
    kept = {key for key in world.rows if key[0] == 0}
    if cancelled:
        world.send(Cancelled(0))
        world.send(Cancelled(0) if world.flying else Paused(0))
    world.run(random)
    assert world.settled.count(0) == 1
    assert {key for key in world.rows if key[0] == 0} == kept
    for study, (cases, _) in enumerate(sizes[1:], start=1):
        assert sum(key[0] == study for key in world.rows) == cases


def test_studies_share_the_capacity_the_oldest_first() -> None:
    world = World(4)
    world.submit(1, 100, 1)
    assert [chunk.study for chunk in world.flying.values()] == [1, 1, 1, 1]
    world.submit(2, 100, 1)
    for _ in range(3):
        world.finish(min(world.flying))
    assert sorted(chunk.study for chunk in world.flying.values()) == [1, 1, 2, 2]
    for _ in range(40):
        world.finish(min(world.flying))
        assert sorted(chunk.study for chunk in world.flying.values()) == [1, 1, 2, 2]


@pytest.mark.parametrize("capacity", [1, 2, 3, 6])
def test_owners_have_equal_shares_however_many_studies_they_have(capacity: int) -> None:
    """Of one rank; priorities count among the studies of one owner, a rank against everybody."""
    machine, started, flying = Dispatch(capacity), Counter[int](), deque[int]()

    def follow(instructions: list[Instruction]) -> None:
        for instruction in instructions:
            if isinstance(instruction, Run):
                started[instruction.chunk.study] += 1
                flying.append(instruction.ticket)

    def offer(study: int, owner: str | None, priority: int = 0, rank: int = 0) -> None:
        chunks = [Chunk(study, first, 1) for first in range(100)]
        follow(machine.handle(Offered(study, chunks, priority, rank=rank, owner=owner)))

    for study in range(8):
        offer(study, "dora", priority=100 if study == 7 else 0)
    offer(10, "emil")
    offer(11, None)
    offer(12, "emil", priority=-1)
    started.clear()
    for _ in range(90):
        follow(machine.handle(Ended(flying.popleft(), Fate.DONE)))
    assert abs(started[7] - 30) <= 1
    assert abs(started[10] - 30) <= 1
    assert abs(started[11] - 30) <= 1
    assert set(started) == {7, 10, 11}
    offer(20, "finn", rank=1)
    offer(21, "gina", rank=-1)
    started.clear()
    for _ in range(60):
        follow(machine.handle(Ended(flying.popleft(), Fate.DONE)))
    assert set(started) == {20}


def test_a_crashing_chunk_is_run_again_whole_before_it_is_split() -> None:
    machine = Dispatch(1)
    (first,) = machine.handle(Offered(0, [Chunk(0, 0, 16)]))
    assert first == Run(1, Chunk(0, 0, 16))
    assert machine.handle(Ended(1, Fate.CRASHED, "x")) == [
        PutBack(Chunk(0, 0, 16, 1), "x"),
        Run(2, Chunk(0, 0, 16, 1)),
    ]
    split, again = machine.handle(Ended(2, Fate.CRASHED, "x"))
    assert split == Split(Chunk(0, 0, 16, 1), tuple(Chunk(0, k, 2, 1) for k in range(0, 16, 2)), "x")
    assert again == Run(3, Chunk(0, 0, 2, 1))


def test_a_case_alone_has_two_lives_of_its_own() -> None:
    assert pieces(Chunk(0, 6, 2, 1)) == (Chunk(0, 6, 1), Chunk(0, 7, 1))
    assert pieces(Chunk(0, 6, 9, 1)) == (*(Chunk(0, case, 1) for case in range(6, 13)), Chunk(0, 13, 2, 1))


def test_one_success_forgives_the_crashes_before_it() -> None:
    world = World(1, crash={(0, 0), (0, 1), (0, 3), (0, 4)})
    world.submit(0, 6, 1)
    world.run(Random(0))
    assert {case for (_, case), ending in world.rows.items() if ending == "crashed"} == {0, 1, 3, 4}


def test_crashes_of_one_study_do_not_hide_behind_the_successes_of_another() -> None:
    world = World(2, crash={(1, case) for case in range(50)})
    world.submit(0, 50, 1)
    world.submit(1, 50, 1)
    world.run(Random(0))
    assert world.renewed == list(world.faults) == [1]
    assert world.settled == [0]


@pytest.mark.parametrize(
    ("ranges", "count"),
    [([], 0), ([(0, 16), (0, 8), (4, 4)], 1), ([(0, 8), (8, 8)], 2), ([(0, 16), (0, 4), (4, 4), (9, 1)], 3)],
)
def test_overlapping_chunks_count_once(ranges: list[tuple[int, int]], count: int) -> None:
    assert disjoint(Chunk(0, first, size) for first, size in ranges) == count


def test_events_about_unknown_things_do_nothing() -> None:
    machine = Dispatch(2)
    for event in (Paused(7), Refused(3), Ended(5, Fate.DONE)):
        assert machine.handle(event) == []
    assert machine.handle(Offered(1)) == [Settle(1)]
    assert machine.handle(Cancelled(9)) == [Settle(9)]
