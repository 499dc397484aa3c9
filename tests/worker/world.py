"""A store and an executor for the state machine of dispatch."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from random import Random

from sprag_study.worker.chunking import spans
from sprag_study.worker.dispatch import (
    Commit,
    Dispatch,
    Ended,
    Event,
    Fault,
    Instruction,
    Offered,
    PutBack,
    Quarantine,
    Refused,
    Renew,
    Run,
    Settle,
    Split,
    Stop,
)
from sprag_study.worker.ports import Chunk, Fate

#: More than any study here needs, even with every case run alone twice.
MOST_ENDS = 5_000


class World:
    """A store and an executor in a few dictionaries, in which chosen cases crash or hang."""

    def __init__(self, capacity: int, crash: Collection[tuple[int, int]] = (), hang: Collection[tuple[int, int]] = ()):
        self.machine = Dispatch(capacity)
        self.crash, self.hang = set(crash), set(hang)
        self.waiting: dict[int, set[Chunk]] = {}
        self.claimed: dict[int, set[Chunk]] = {}
        self.flying: dict[int, Chunk] = {}
        self.rows: dict[tuple[int, int], str] = {}
        self.settled: list[int] = []
        self.renewed: list[int] = []
        self.faults: dict[int, str] = {}
        self.stopping: set[int] = set()
        self.refusing = False
        self.most_flying = 0

    def submit(self, study: int, cases: int, size: int) -> None:
        self.waiting[study] = {Chunk(study, first, count) for first, count in spans(cases, size)}
        self.claimed[study] = set()
        self.offer(study)

    def offer(self, study: int) -> None:
        self.send(Offered(study, sorted(self.waiting[study], key=lambda chunk: chunk.first)))

    def send(self, event: Event) -> None:
        for instruction in self.machine.handle(event):
            self.do(instruction)

    def do(self, instruction: Instruction) -> None:
        match instruction:
            case Run(ticket, chunk):
                assert chunk in self.waiting[chunk.study]
                if self.refusing:
                    self.send(Refused(ticket))
                    return
                self.move(chunk, self.waiting, self.claimed)
                assert ticket not in self.flying
                self.flying[ticket] = chunk
                self.most_flying = max(self.most_flying, len(self.flying))
            case Commit(_, chunk):
                self.end(chunk, "ok")
            case Quarantine(chunk, ending, _):
                assert chunk.count == 1
                self.end(chunk, ending.value)
            case PutBack(chunk, _):
                self.claimed[chunk.study] = {
                    claimed for claimed in self.claimed[chunk.study] if claimed.first != chunk.first
                }
                self.waiting[chunk.study].add(chunk)
            case Split(chunk, parts, _):
                assert [case for part in parts for case in range(part.first, part.last + 1)] == list(
                    range(chunk.first, chunk.last + 1)
                )
                self.claimed[chunk.study].remove(chunk)
                self.waiting[chunk.study].update(parts)
            case Stop(ticket):
                self.stopping.add(ticket)
            case Fault(study, reason):
                self.faults[study] = reason
                self.waiting[study] |= self.claimed[study]
                self.claimed[study].clear()
            case Renew(study, reason):
                self.renewed.append(study)
                self.flying.clear()
                for number, claimed in self.claimed.items():
                    self.waiting[number] |= claimed
                    claimed.clear()
                self.waiting[study] = {replace(chunk, failures=0) for chunk in self.waiting[study]}
                for number in set(self.waiting) - set(self.settled) - set(self.faults):
                    self.offer(number)
            case Settle(study):
                assert not any(chunk.study == study for chunk in self.flying.values())
                self.settled.append(study)

    @staticmethod
    def move(chunk: Chunk, source: dict[int, set[Chunk]], target: dict[int, set[Chunk]]) -> None:
        source[chunk.study].remove(chunk)
        target[chunk.study].add(chunk)

    def end(self, chunk: Chunk, ending: str) -> None:
        self.claimed[chunk.study].remove(chunk)
        for case in range(chunk.first, chunk.last + 1):
            assert (chunk.study, case) not in self.rows
            self.rows[chunk.study, case] = ending

    def fate(self, chunk: Chunk) -> Fate:
        for case in range(chunk.first, chunk.last + 1):
            if (chunk.study, case) in self.crash:
                return Fate.CRASHED
            if (chunk.study, case) in self.hang:
                return Fate.TIMED_OUT
        return Fate.DONE

    def finish(self, ticket: int, fate: Fate | None = None) -> None:
        chunk = self.flying.pop(ticket)
        stopped = Fate.STOPPED if ticket in self.stopping else None
        self.send(Ended(ticket, fate or stopped or self.fate(chunk), "so it went"))

    def run(self, random: Random) -> None:
        """Let chunks come to their ends in any order until nothing is in flight."""
        for _ in range(MOST_ENDS):
            if not self.flying:
                return
            self.finish(random.choice(sorted(self.flying)))
        raise AssertionError("chunks are run again and again")
