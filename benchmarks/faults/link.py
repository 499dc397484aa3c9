"""Links between hosts are cut and mended while a study runs on a Dask cluster of several; one host is lost for good."""

from __future__ import annotations

import subprocess
import time
from pathlib import Path
from typing import Any

from benchmarks.faults import harness
from benchmarks.faults.cluster import clusters
from benchmarks.faults.hosts import hosts
from sprag_study.service.storage.store import Store
from sprag_study.worker.chunking import Chunking

#: Seconds after which a connection counts as lost: the fewest that Dask takes, instead of 30.
LOST_SECONDS = 11
_MISSED = "cannot be reached; retrying"
_PARTS = ("SCHEDULER", "WORKER", "CLIENT")


def link(folder: Path, *, cases: int, periods: float, chunk: int = 10) -> dict[str, Any]:
    """Run a study of ``cases`` cases on two computing hosts under three cuts; gives the figures.

    The link of one host that computes is cut and mended, then that of the dispatcher, and that of the other host that
    computes for good.
    """
    made = harness.spec(cases, periods)
    database = folder / "sprag.sqlite3"
    settings = _certificates(folder) | {"DASK_DISTRIBUTED__COMM__TIMEOUTS__TCP": f"{LOST_SECONDS}s"}
    log = folder / "worker.log"
    with hosts("head", "one", "two", "desk") as net, clusters(net.address("head"), "tls", **settings) as dask:
        dask.start_scheduler(net.begin("head"))
        for name in ("one", "two"):
            dask.start_worker(net.begin(name), net.address(name))
        with Store.open(f"sqlite:///{database}", chunking=Chunking(cases=chunk)) as store:
            study = store.studies.create({}, harness.study_of(made)).id
        command = [*net.begin("desk"), *harness.COMMAND, "worker", "--db", str(database)]
        with log.open("wb") as output:
            dispatcher = subprocess.Popen(
                command, stdout=output, stderr=output, env=harness.environment(**settings, SPRAG_EXECUTOR=dask.url)
            )
        begin = time.monotonic()
        try:
            _until_done(database, study, cases, 0.1)
            net.cut("one")
            _until_done(database, study, cases, 0.3)
            net.mend("one")
            _until_done(database, study, cases, 0.5)
            net.cut("desk")
            harness.until(lambda: _MISSED in log.read_text(), "the dispatcher misses the scheduler")
            net.mend("desk")
            _until_done(database, study, cases, 0.7)
            net.cut("two")
            ended = "SELECT finished_at FROM studies WHERE id = ?"
            harness.until(lambda: harness.asked(database, ended, study), "the study ended")
        finally:
            alive = dispatcher.poll() is None
            dispatcher.kill()
            dispatcher.wait()
    assert alive, log.read_text()
    harness.compare(database, study, made)
    return {
        "cases": cases,
        "cuts": {"computing host": 1, "dispatcher": 1, "computing host, for good": 1},
        "missing, duplicate and wrong rows": 0,
        "seconds": round(time.monotonic() - begin, 1),
    }


def _until_done(database: Path, study: str, cases: int, share: float) -> None:
    harness.until(lambda: harness.done(database, study) >= share * cases, f"{share:.0%} of the study are done")


def _certificates(folder: Path) -> dict[str, str]:
    """A certificate that vouches for itself, and the settings that give it to all parts of a cluster."""
    certificate, key = folder / "certificate.pem", folder / "key.pem"
    command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=sprag"]
    subprocess.run([*command, "-keyout", key, "-out", certificate], check=True, capture_output=True)
    tls = "DASK_DISTRIBUTED__COMM__TLS"
    found = {f"{tls}__CA_FILE": str(certificate), "DASK_DISTRIBUTED__COMM__REQUIRE_ENCRYPTION": "true"}
    for part in _PARTS:
        found |= {f"{tls}__{part}__CERT": str(certificate), f"{tls}__{part}__KEY": str(key)}
    return found
