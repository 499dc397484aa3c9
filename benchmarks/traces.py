"""What traces cost: a study through dispatcher, pool and SQLite with and without them, in turn, in one run.

The spans go to a receiver of this process that does nothing with them; what counts is the ratio of processor times,
which include the receiver. Without traces the
code is that of a service whose environment asks for none.

    python -m benchmarks.traces [--cases 4000] [--chunk 100] [--processes N] [--repeats 5]
"""

from __future__ import annotations

import argparse
import os
import statistics
import tempfile
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from benchmarks.overhead import cpu_seconds, example, through_the_service
from sprag_study.service.settings import available_cores
from sprag_study.service.storage.part import SystemClock
from sprag_study.service.storage.store import Store
from sprag_study.worker import models, traces
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.executors.process_pool import ProcessPoolExecutor


class Sink(BaseHTTPRequestHandler):
    """Takes spans and forgets them."""

    taken = 0

    def do_POST(self) -> None:
        """Spans of a process."""
        Sink.taken += len(self.rfile.read(int(self.headers["Content-Length"])))
        self.send_response(200)
        self.send_header("Content-Length", "0")
        self.end_headers()

    def log_message(self, *_: object) -> None:
        """Nothing on standard error."""


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=4_000)
    parser.add_argument("--chunk", type=int, default=100)
    parser.add_argument("--processes", type=int, default=available_cores())
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    sink = ThreadingHTTPServer(("127.0.0.1", 0), Sink)
    sink.daemon_threads = True
    threading.Thread(target=sink.serve_forever, daemon=True).start()
    os.environ |= {"OTEL_EXPORTER_OTLP_ENDPOINT": f"http://127.0.0.1:{sink.server_address[1]}", "NO_PROXY": "*"}
    study = example(options.cases, 20.0)
    models.warm_up(study)
    ending = threading.Event()
    times: dict[str, list[float]] = {"without": [], "with": []}
    with (
        tempfile.TemporaryDirectory() as folder,
        Store.open(f"sqlite:///{Path(folder) / 'a.sqlite3'}", chunking=Chunking(cases=options.chunk)) as store,
    ):
        pool = ProcessPoolExecutor(options.processes, chunk_timeout=600.0)
        dispatcher = threading.Thread(target=Dispatcher(store.work, pool, SystemClock()).run, args=(ending.is_set,))
        dispatcher.start()
        try:
            for turn in range(options.repeats + 1):
                for kind, seconds in times.items():
                    if kind == "with":
                        traces.start()
                    begin = cpu_seconds([os.getpid()])
                    with traces.span("request"):
                        through_the_service(store, study)
                    traces.stop()
                    seconds.append(cpu_seconds([os.getpid()]) - begin)
                if not turn:  # processes load the kernel, and OpenTelemetry
                    times = {kind: [] for kind in times}
                    continue
                print("  ".join(f"{kind} {seconds[-1]:6.2f} s" for kind, seconds in times.items()), flush=True)
        finally:
            ending.set()
            dispatcher.join()
            sink.shutdown()
    least, middle = (pick(times["with"]) / pick(times["without"]) for pick in (min, statistics.median))
    cases = f"{options.cases} cases in chunks of {options.chunk}"
    print(f"{cases}, {options.processes} processes; {Sink.taken} bytes of spans")
    print(f"with / without: ratio of least times {least:.3f}, of medians {middle:.3f}")


if __name__ == "__main__":
    main()
