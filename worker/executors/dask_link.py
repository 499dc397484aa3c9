"""The connection of `sprag_study.worker.executors.dask` to a scheduler, which may be lost and restored."""

from __future__ import annotations

import logging
import socket
from concurrent.futures import CancelledError
from contextlib import closing, suppress
from http import HTTPStatus
from http.client import HTTPConnection, HTTPException
from threading import Condition
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlsplit

from distributed import Client, LocalCluster
from distributed.client import AllExit

from sprag_study.worker.executors.dask_tasks import blame_at_once, end_worker

if TYPE_CHECKING:
    from collections.abc import Callable
    from threading import RLock

    from distributed import Future, Security

#: Seconds within which the scheduler must answer.
ANSWER_SECONDS: Final = 5
#: Seconds within which the scheduler's page must answer, once for each connection.
DASHBOARD_SECONDS: Final = 1.0
#: Seconds within which the value of a finished task must arrive.
VALUE_SECONDS: Final = 15.0
#: Seconds for which the connection is kept open for values being fetched.
FETCH_SECONDS: Final = 5.0
#: Configuration of every Dask process that is started here.
CONFIG: Final = {
    "distributed.scheduler.allowed-failures": 0,
    # No dashboard or other pages.
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    "distributed.worker.memory.terminate": False,
}


def _is_news(record: logging.LogRecord) -> bool:
    return record.exc_info is None or not isinstance(record.exc_info[1], AllExit)


# Dask's client logs lost connections with tracebacks, which are reported here in one sentence, and abandoned fetches of
# lost values, which are irrelevant.
for _name in ("distributed", "distributed.client"):  # Dask sets a separate level for the second
    logging.getLogger(_name).setLevel(logging.CRITICAL)
logging.getLogger("asyncio").addFilter(_is_news)


class Link:
    """A connection to the scheduler at ``address``; ``lock`` is the one under which `begin_fetch` is called."""

    def __init__(self, address: str, security: Security | None, name: str, lock: RLock) -> None:
        self.address = address
        #: Why the scheduler did not answer the last time that it did not.
        self.trouble = ""
        #: URL of the scheduler's dashboard; "" where it has none.
        self.dashboard = ""
        self._port: int | None = None
        self._security = security
        self._name = name
        self._client: Client | None = None
        #: Dask's threads that are fetching a value and need the connection.
        self._fetching = 0
        self._fetched = Condition(lock)

    def present(self) -> dict[str, dict[str, Any]]:
        """The workers that the scheduler knows, by address. Raises OSError, TimeoutError or ValueError without a
        scheduler; `trouble` then says why.
        """
        try:
            return self._present()
        except (OSError, TimeoutError, ValueError) as error:
            self.trouble = str(error) or type(error).__name__
            raise

    def _present(self) -> dict[str, dict[str, Any]]:
        if self._client is None:
            place = urlsplit(self.address)
            # Dask's client takes five seconds for this, and leaves a half-made object behind.
            socket.create_connection((str(place.hostname), int(place.port or 0)), ANSWER_SECONDS).close()
            self._client = Client(
                self.address, security=self._security, timeout=ANSWER_SECONDS, set_as_default=False, name=self._name
            )
            # Deaths are counted here, once; the scheduler must not retry the chunk on another worker.
            self._tell(blame_at_once)
        if self._client.status != "running":
            raise OSError("the connection to the scheduler is lost")
        scheduler: Any = self._client.scheduler
        found: dict[str, Any] = self._client.sync(scheduler.identity, n_workers=-1, callback_timeout=ANSWER_SECONDS)
        self._find_dashboard(found.get("services", {}).get("dashboard"))
        present: dict[str, dict[str, Any]] = found["workers"]
        return present

    def _find_dashboard(self, port: int | None) -> None:
        """Keep the dashboard at that port where it answers: Dask names a port without a dashboard, too."""
        if port == self._port:
            return
        self._port, self.dashboard = port, ""
        if port is None:
            return
        page = HTTPConnection(str(urlsplit(self.address).hostname), port, timeout=DASHBOARD_SECONDS)
        with closing(page), suppress(OSError, HTTPException):
            page.request("GET", "/status")
            with page.getresponse() as answer:
                if answer.status == HTTPStatus.OK:
                    self.dashboard = f"http://{page.host}:{port}/status"

    def submit(
        self, address: str, key: str, done: Callable[[Future[Any]], None], function: Callable[..., Any], *given: Any
    ) -> Future[Any] | None:
        """Call a function in the worker at ``address``; None where the connection is being lost."""
        if self._client is not None:
            with suppress(Exception):
                future: Future[Any] = self._client.submit(
                    function, *given, key=key, workers=[address], allow_other_workers=False, pure=False, retries=0
                )
                future.add_done_callback(done)
                return future
        return None

    def begin_fetch(self) -> None:
        """Keep the connection until `end_fetch`; under the lock."""
        self._fetching += 1

    def end_fetch(self) -> None:
        """See `begin_fetch`."""
        self._fetching -= 1
        self._fetched.notify_all()

    def end_worker(self, address: str) -> None:
        """End the process of a worker; its nanny, if any, starts another."""
        with suppress(Exception):
            self._tell(end_worker, address, wait=False)

    def _tell(self, function: Callable[..., Any], *given: Any, wait: bool = True) -> None:
        """Call a function in the scheduler. The client's own method for this has no timeout."""
        if self._client is not None:
            tell: Any = self._client._run_on_scheduler
            self._client.sync(tell, function, *given, wait=wait, callback_timeout=ANSWER_SECONDS)

    def close(self, timeout: float) -> None:
        """Close the connection once no value is being fetched over it; all jobs have been abandoned before."""
        with self._fetched:
            client, self._client = self._client, None
            self._fetched.wait_for(lambda: not self._fetching, FETCH_SECONDS)
        if client is not None:
            with suppress(Exception):
                client.close(timeout=timeout)


def own_cluster(processes: int) -> LocalCluster:
    """A cluster of that many workers on this machine."""
    return LocalCluster(
        n_workers=processes, threads_per_worker=1, host="127.0.0.1", memory_limit=0,
        dashboard_address="127.0.0.1:0", scheduler_kwargs={"dashboard": False}, silence_logs=logging.CRITICAL,
    )  # fmt: skip


def value_of(future: Future[Any]) -> tuple[Any, BaseException | None]:
    """The value of a finished future, or the reason why there is none."""
    try:
        error = future.exception(timeout=VALUE_SECONDS) if future.status != "finished" else None
        return (future.result(timeout=VALUE_SECONDS) if error is None else None), error
    except Exception as trouble:  # the value was lost with its worker or the scheduler
        return None, CancelledError(str(trouble))
    except CancelledError as trouble:
        return None, trouble
