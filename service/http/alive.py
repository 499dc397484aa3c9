"""``python -m sprag_study.service.http.alive``: whether the service of this machine's settings answers, for health
checks.

Host, port and TLS are those of the settings (environment and the file of SPRAG_SETTINGS), as `sprag serve` reads them.
"""

from __future__ import annotations

import ipaddress
import ssl
import sys
from http.client import HTTPException
from typing import Final
from urllib.error import URLError
from urllib.request import HTTPSHandler, ProxyHandler, build_opener

from sprag_study.service.settings import Settings

#: Seconds for the answer.
_SECONDS: Final = 4.0


def address(settings: Settings) -> str:
    """The address of /livez at which this machine reaches the service."""
    host = settings.host.strip("[]")
    try:
        listening = ipaddress.ip_address(host)
    except ValueError:
        listening = None
    if listening is not None and listening.is_unspecified:  # it listens on every address
        host = "127.0.0.1" if listening.version == 4 else "::1"
    return f"{settings.model_copy(update={'host': host}).address(settings.port)}/livez"


def is_alive(settings: Settings) -> bool:
    """Whether the service answers its /livez."""
    # It asks itself: the certificate has the name of the service, which is not the address asked here.
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    try:
        with build_opener(ProxyHandler({}), HTTPSHandler(context=context)).open(address(settings), timeout=_SECONDS):
            return True
    except (URLError, HTTPException, OSError):
        return False


if __name__ == "__main__":
    sys.exit(not is_alive(Settings()))
