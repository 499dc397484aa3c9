"""Attempts to log in with an invalid token: logged, answered more and more slowly, limited in number.

Only refusals are delayed: a valid token is accepted immediately, unless several refusals of its address are waiting; so
more connections do not make guessing faster. Attackers at many addresses lock nobody else out.
"""

from __future__ import annotations

import ipaddress
import logging
import time
from collections.abc import Awaitable, Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final

import anyio
from cachetools import TTLCache
from starlette.datastructures import Headers
from starlette.types import Scope

from sprag_study.service.http.problems import ApiError

_LOG = logging.getLogger("sprag.access")

#: Seconds before the first refusal of an address, doubled for each further one up to the longest.
FIRST_SECONDS: Final = 0.25
LONGEST_SECONDS: Final = 4.0
#: Seconds without a failed attempt after which an address starts afresh.
FORGET_SECONDS: Final = 900.0
#: Most waiting refusals of one address; further attempts from there are refused immediately, whatever their token.
MOST_WAITING: Final = 4
#: Most waiting refusals in all, because each occupies a connection; further ones do not wait.
MOST_WAITING_IN_ALL: Final = 64
#: Addresses that are remembered: the latest ones.
_MOST_ADDRESSES: Final = 10_000
#: Length of the network prefix of an IPv6 address; one client owns all addresses of its network.
_NETWORK_BITS: Final = 64
_UNKNOWN: Final = "an unknown address"

Network = ipaddress.IPv4Network | ipaddress.IPv6Network


@dataclass(slots=True)
class _History:
    failures: int = 0
    waiting: int = 0


class Attempts:
    """Failed attempts by address. For one event loop.

    Parameters
    ----------
    trusted : networks of proxies whose X-Forwarded-For is trusted
    sleep, clock : functions
        Wait for a number of seconds; seconds since any fixed time. Replaced in tests.
    """

    def __init__(
        self,
        trusted: Iterable[Network] = (),
        sleep: Callable[[float], Awaitable[None]] = anyio.sleep,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._trusted = tuple(trusted)
        self._sleep = sleep
        self._histories: TTLCache[str, _History] = TTLCache(_MOST_ADDRESSES, FORGET_SECONDS, timer=clock)
        self._waiting = 0

    def address_of(self, scope: Scope) -> str:
        """Address of the client: the connection's, or the one that a trusted proxy reports."""
        client = scope.get("client")
        address = str(client[0]) if client else _UNKNOWN
        # The nearest proxy wrote the last entry; each earlier one is trusted only if a trusted proxy wrote it.
        entries = ",".join(Headers(scope=scope).getlist("x-forwarded-for")).split(",")
        for entry in reversed(entries):
            if not self._is_trusted(address) or _parsed(entry.strip()) is None:
                break
            address = str(_parsed(entry.strip()))
        return address

    def from_proxy(self, scope: Scope) -> bool:
        """Whether the connection comes from a trusted proxy."""
        client = scope.get("client")
        return client is not None and self._is_trusted(str(client[0]))

    def _is_trusted(self, address: str) -> bool:
        parsed = _parsed(address)
        return parsed is not None and any(parsed in network for network in self._trusted)

    def admit(self, scope: Scope) -> None:
        """Raise ApiError when too many refusals of the client's address are waiting."""
        history = self._histories.get(_network(self.address_of(scope)))
        if history is not None and history.waiting >= MOST_WAITING:
            raise _too_many()

    async def failed(self, scope: Scope, place: str) -> None:
        """Record an invalid token at ``place``, and wait before answering.

        Raises ApiError immediately where too many refusals are waiting.
        """
        address = self.address_of(scope)
        # The words and their order are those of the filter for fail2ban in the documentation.
        _LOG.warning("Failed login from %s: %s", address, place)
        network = _network(address)
        # Inserted anew, so that an address is remembered from its latest failure.
        history = self._histories[network] = self._histories.get(network) or _History()
        history.failures += 1
        if self._waiting >= MOST_WAITING_IN_ALL:
            raise _too_many()
        with self._in_line(history):
            await self._sleep(min(FIRST_SECONDS * 2.0 ** min(history.failures - 1, 30), LONGEST_SECONDS))

    @contextmanager
    def _in_line(self, history: _History) -> Iterator[None]:
        history.waiting += 1
        self._waiting += 1
        try:
            yield
        finally:
            history.waiting -= 1
            self._waiting -= 1


def _too_many() -> ApiError:
    return ApiError(
        "too-many-attempts",
        "Too many attempts with tokens that are not valid.",
        headers={"Retry-After": str(int(LONGEST_SECONDS))},
    )


def _parsed(address: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    """The address without port and zone; None when it is invalid. IPv4-mapped IPv6 addresses become IPv4 addresses."""
    text = address.removeprefix("[").partition("]")[0] if address.startswith("[") else address
    host, colon, port = text.partition(":")
    if colon and ":" not in port and port.isdigit():
        text = host
    try:
        parsed = ipaddress.ip_address(text.partition("%")[0])
    except ValueError:
        return None
    return getattr(parsed, "ipv4_mapped", None) or parsed


def _network(address: str) -> str:
    """The key of one client: an IPv4 address, or an IPv6 network."""
    parsed = _parsed(address)
    if isinstance(parsed, ipaddress.IPv6Address):
        return str(ipaddress.ip_network((parsed, _NETWORK_BITS), strict=False))
    return address
