"""Random requests to every operation of the API, in all phases of schemathesis; takes minutes.

``python -m benchmarks.fuzz --examples 100``: a service of its own behind a real server on this machine, with a token,
on a database with studies of made-up rows; motions are computed for real. The suite sends a few of the same requests
(tests/service/http/test_fuzzing.py).
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import httpx
from pydantic import SecretStr

from sprag_study.service.http import attempts
from sprag_study.service.http.app import chunking, create_app
from sprag_study.service.settings import Settings
from sprag_study.service.storage.store import Store
from tests.service.conftest import InThread, Service
from tests.service.http.fuzzing import fuzz, with_ids
from tests.service.http.test_fuzzing import TOKEN, things
from tests.serving import served


def main() -> None:
    """Send them and tell what came of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--examples", type=int, default=100, help="requests of each kind to each operation")
    options = parser.parse_args()
    attempts.FIRST_SECONDS = 0.0  # type: ignore[misc]  # thousands of requests have an invalid token, and would wait 4 s each
    with tempfile.TemporaryDirectory() as folder:
        settings = Settings(
            database=str(Path(folder) / "sprag.sqlite3"), chunk_cases=2, processes=2, token=SecretStr(TOKEN)
        )
        with Store.open(settings.database_url, chunking=chunking(settings)) as store:
            app = create_app(settings, store=store)
            app.state.context.ending.set()  # streams of events end at once
            with (
                served(app) as address,
                httpx.Client(base_url=address, headers={"Authorization": f"Bearer {TOKEN}"}, timeout=600) as client,
            ):
                ids = things(Service(app, client, store, InThread()))
                document = client.get("/openapi.json").json()
                began = time.monotonic()
                summary = fuzz(with_ids(document, ids), TOKEN, options.examples, address=address)
                print(f"{summary}\nin {time.monotonic() - began:.0f} s")
            app.state.context.computer.close()
    print("most of the time, until the answers came:")
    for label, (count, seconds) in sorted(summary.spent.items(), key=lambda item: -item[1][1])[:8]:
        print(f"{seconds:6.0f} s  {count:6,} requests  {label}")
    for finding, more in summary.findings.items():
        print(f"{finding}\n{more}\n")


if __name__ == "__main__":
    main()
