"""A cluster is upgraded host by host while a study runs, and its scheduler is replaced (docs/deployment.md)."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.faults.harness import COMMAND, PATIENCE, environment, kill_family, spec, study_of, until
from sprag_study.service.jobs.workers import worker_list
from sprag_study.service.storage.store import Store
from sprag_study.worker import fingerprint, models
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.states import StudyState
from tests.conftest import ROOT
from tests.worker.executors.clusters import LEAVES_CONNECTIONS, Cluster, clusters

pytestmark = LEAVES_CONNECTIONS

CASES = 4000
#: Cases that are waited for in each step: all steps together take far fewer than there are.
A_FEW = 50


@dataclass
class Upgrade:
    """A cluster of two hosts and a dispatcher, each of which is of the old or of the new version."""

    store: Store
    cluster: Cluster
    folder: Path
    study: str
    dispatcher: subprocess.Popen[bytes] | None = None
    hosts: dict[str, subprocess.Popen[bytes]] = field(default_factory=dict)

    def version(self, name: str) -> Path:
        """A folder from which that version is imported: the same sources, and for the new one another number."""
        folder = self.folder / name
        if not folder.exists():
            folder.mkdir()
            (folder / "sprag_study").symlink_to(ROOT / "sprag_study")
            if name == "new":
                about = folder / "sprag_study-9.9.9.dist-info"
                about.mkdir()
                (about / "METADATA").write_text("Name: sprag-study\nVersion: 9.9.9\n")
        return folder

    def start_host(self, host: str, version: str) -> None:
        """Start the workers of a host, or restart them as another version."""
        if host in self.hosts:
            self.hosts[host].send_signal(signal.SIGTERM)
            self.hosts[host].wait(PATIENCE)
            kill_family(self.hosts[host])
        self.cluster.start_worker(folder=self.version(version))
        self.hosts[host] = self.cluster.workers[-1]

    def start_dispatcher(self, version: str) -> None:
        """Start `sprag admin worker`, or restart it as another version."""
        if self.dispatcher is not None:
            self.dispatcher.send_signal(signal.SIGTERM)
            assert self.dispatcher.wait(PATIENCE) == 0
        folder = self.version(version)
        variables = environment(SPRAG_EXECUTOR=self.cluster.url, SPRAG_DATABASE=str(self.store.session.path))
        with (self.folder / "worker.log").open("ab") as log:
            self.dispatcher = subprocess.Popen(
                [*COMMAND, "worker"], cwd=folder, env={**variables, "PYTHONPATH": str(folder)}, stdout=log, stderr=log
            )

    def workers(self) -> tuple[int, list[str]]:
        """How many workers are usable, and why others are refused, by the dispatcher that is at work."""
        alive = [found for found in worker_list(self.store.dispatchers)["dispatchers"] if found["ended_at"] is None]
        reasons = [worker["reason"] for found in alive for worker in found["refused"]]
        return sum(found["usable"] for found in alive), reasons

    def done(self) -> int:
        return self.store.studies.get(self.study).done

    def goes_on(self) -> None:
        """Let the study run until cases have been added. It is paused otherwise, so that no machine is too fast."""
        before = self.done()
        self.store.studies.resume(self.study)
        until(lambda: self.done() >= before + A_FEW, f"more cases than {before} were done")
        self.store.studies.pause(self.study)


@contextmanager
def upgraded(folder: Path) -> Iterator[Upgrade]:
    """Two hosts, a scheduler and a dispatcher of the old version, which run a study."""
    with ExitStack() as stack:
        cluster = stack.enter_context(clusters())
        store = stack.enter_context(Store.open(f"sqlite:///{folder / 'a.sqlite3'}", chunking=Chunking(cases=10)))
        record = store.studies.create({}, study_of(spec(CASES, periods=20)))
        store.studies.pause(record.id)
        found = Upgrade(store, cluster, folder, record.id)
        try:
            cluster.start_scheduler()
            for host in ("a", "b"):
                found.start_host(host, "old")
            found.start_dispatcher("old")
            yield found
        except BaseException:
            print((folder / "worker.log").read_text(encoding="utf-8"))
            raise
        finally:
            if found.dispatcher is not None:
                kill_family(found.dispatcher)


def test_hosts_are_upgraded_in_turn_and_the_scheduler_is_replaced_while_a_study_runs(tmp_path: Path) -> None:
    """After each step the study goes on; in the end every row is there, with the fingerprint of its code."""
    refused = [f"sprag: 9.9.9 instead of {fingerprint.present()['sprag']}"]
    obsolete = [f"sprag: {fingerprint.present()['sprag']} instead of 9.9.9"]
    with upgraded(tmp_path) as office:

        def step(change: Callable[[], Any], *expected: Any) -> None:
            change()
            until(lambda: office.workers() == expected, f"the workers are {expected}")
            office.goes_on()

        until(lambda: office.workers() == (2, []), "both hosts are used")
        office.goes_on()
        # The first host is new: the old dispatcher gives it nothing, and the second one goes on.
        step(lambda: office.start_host("a", "new"), 1, refused)
        # The dispatcher is new: now the first host works, and the second one is refused.
        step(lambda: office.start_dispatcher("new"), 1, obsolete)
        step(lambda: office.start_host("b", "new"), 2, [])

        def replace_scheduler() -> None:
            """What a supervisor does: the scheduler and what ends with it are started again, at the same address."""
            assert office.cluster.scheduler is not None
            office.cluster.scheduler.kill()
            office.cluster.scheduler.wait()
            office.cluster.start_scheduler()
            for host in ("a", "b"):
                office.start_host(host, "new")

        replaced = office.dispatcher
        step(replace_scheduler, 2, [])
        assert office.dispatcher is replaced
        assert replaced is not None
        assert replaced.poll() is None  # it has found the new scheduler by itself
        office.store.studies.resume(office.study)
        until(lambda: office.store.studies.get(office.study).state.terminal, "the study has ended")
        ended = office.store.studies.get(office.study)
        assert (ended.state, ended.done) == (StudyState.FINISHED, CASES)
        blocks = list(office.store.rows.blocks(office.study))
        assert np.concatenate([block.cases for block in blocks]).tolist() == list(range(CASES))
        values = np.concatenate([block.values for block in blocks])
        np.testing.assert_array_equal(
            values, models.run_chunk(office.store.studies.study(office.study), 0, CASES).values
        )
        digests = {origin.fingerprint for origin in office.store.rows.origins(office.study)}
        assert len(digests) == 2
        assert fingerprint.digest() in digests
        assert "mixed-origins" in {warning.code for warning in ended.warnings}
