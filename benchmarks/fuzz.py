"""Made-up requests to every operation of the interface: ``python -m benchmarks.fuzz --examples 100``; takes minutes.

The service runs in this process, on an empty database with one study of made-up rows. The suite sends a few of the same
requests (tests/service/test_fuzzing.py).
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

from anyio.from_thread import start_blocking_portal

from service.api.schedules import EXAMPLE
from service.app import chunking, create_app
from service.settings import Settings
from service.storage.store import Store
from tests.service.conftest import InThread, PortalTransport, Service
from tests.service.fuzzing import fuzz
from tests.service.test_fuzzing import not_here


def main() -> None:
    """Send them and tell what came of it."""
    import httpx

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--examples", type=int, default=100, help="requests of each kind to each operation")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, start_blocking_portal() as portal:
        settings = Settings(database=str(Path(folder) / "sprag.sqlite3"), chunk_cases=2, processes=2)
        with Store.open(settings.database_url, chunking=chunking(settings)) as store:
            computer = InThread()
            computer.answer = not_here
            app = create_app(settings, store=store, computer=computer)
            app.state.context.ending.set()
            client = httpx.Client(transport=PortalTransport(app, portal), base_url="http://localhost")
            service = Service(app, client, store, computer)
            study_id = service.submit()
            service.fill(study_id)
            kept = client.post("/api/v1/schedules", json=EXAMPLE).json()["id"]
            began = time.monotonic()
            summary = fuzz(client, {"study_id": study_id, "case": "0", "schedule_id": kept}, options.examples)
    print(f"{summary} in {time.monotonic() - began:.0f} s")
    print("\n".join(summary.findings))


if __name__ == "__main__":
    main()
