"""TLS without a proxy: the certificate of the service, checked before it listens and read again when it is renewed."""

from __future__ import annotations

import logging
import ssl
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from sprag_study.service.settings import Settings

_LOG = logging.getLogger("sprag.service")

#: Seconds between two looks for a renewed certificate.
LOOK_SECONDS: Final = 60


class CertificateError(Exception):
    """The certificate or its key cannot be used; the message is one plain sentence."""


def _no_passphrase() -> str:
    raise CertificateError("the key is encrypted; write it without a passphrase, readable for the service only")


@dataclass(slots=True)
class Certificate:
    """A certificate with those of its issuers, and its key, as files in PEM; the key may be in the same file."""

    file: Path
    key: Path
    _stamp: tuple[int, ...] = field(init=False)

    def __post_init__(self) -> None:
        """Check the files; raises CertificateError."""
        self._stamp = self._times()
        self._read(ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER))

    @classmethod
    def of(cls, settings: Settings) -> Certificate | None:
        """The certificate of the settings, None where they have none; raises CertificateError."""
        if not settings.tls_certificate:
            if settings.tls_key:
                raise CertificateError("SPRAG_TLS_KEY needs SPRAG_TLS_CERTIFICATE, the certificate that it belongs to.")
            return None
        file = Path(settings.tls_certificate).expanduser().absolute()
        return cls(file, Path(settings.tls_key).expanduser().absolute() if settings.tls_key else file)

    def renew(self, context: ssl.SSLContext) -> bool:
        """Let new connections of ``context`` have the certificate, where the files have changed; whether they have.

        Files that cannot be used are logged once, and the old certificate stays.
        """
        try:
            stamp = self._times()
        except CertificateError:
            return False  # between two files of a renewal; an error if it lasts until the next start
        if stamp == self._stamp:
            return False
        self._stamp = stamp
        try:
            self._read(ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER))  # a context keeps half of what it could not load
            self._read(context)
        except CertificateError as error:
            _LOG.error("The certificate has changed and is not used: %s", error)
            return False
        _LOG.info("The certificate %s was read again.", self.file)
        return True

    def _times(self) -> tuple[int, ...]:
        try:
            return tuple(path.stat().st_mtime_ns for path in (self.file, self.key))
        except OSError as error:
            raise self._fault(error.strerror or str(error)) from None

    def _read(self, context: ssl.SSLContext) -> None:
        try:
            context.load_cert_chain(self.file, self.key, _no_passphrase)
        except CertificateError as error:
            raise self._fault(str(error)) from None
        except ssl.SSLError as error:
            raise self._fault(_WORDS.get(error.reason or "", _others(error))) from None
        except OSError as error:
            raise self._fault(error.strerror or str(error)) from None

    def _fault(self, reason: str) -> CertificateError:
        return CertificateError(
            f"The certificate {self.file} (SPRAG_TLS_CERTIFICATE) and the key {self.key} (SPRAG_TLS_KEY) cannot be "
            f"used: {reason}."
        )


_WORDS: Final = {
    "KEY_VALUES_MISMATCH": "the key belongs to another certificate",
    "EE_KEY_TOO_SMALL": "the key is too short",
    "CA_MD_TOO_WEAK": "the signature algorithm is too weak",
}


def _others(error: ssl.SSLError) -> str:
    return f"OpenSSL refuses them: {error.reason}" if error.reason else "they are not PEM"
