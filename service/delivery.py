"""Settings of reports that leave the service: mail server, webhooks, and the address of links."""

from __future__ import annotations

import base64
import binascii
from dataclasses import dataclass, field
from typing import Annotated, Final, Literal
from urllib.parse import SplitResult, unquote, urlsplit

from pydantic import Field, SecretStr, ValidationInfo, field_validator
from pydantic_settings import BaseSettings, NoDecode

from sprag_study.service.languages import ENGLISH, available

Security = Literal["tls", "starttls", "none"]
_SCHEMES: Final[dict[str, tuple[Security, int]]] = {
    "smtps": ("tls", 465),
    "smtp": ("starttls", 587),
    "smtp+plain": ("none", 25),
}
_PORTS: Final = {"http": 80, "https": 443}
#: Prefix and sizes (bytes) of secrets, as Standard Webhooks has them.
_SECRET_PREFIX: Final = "whsec_"  # noqa: S105 - not a secret itself
_SECRET_BYTES: Final = range(24, 65)


@dataclass(frozen=True, slots=True)
class MailServer:
    """A mail server; "tls" from the start, by the command STARTTLS, or none. ``user`` None: without login."""

    host: str
    port: int
    security: Security
    user: str | None = None
    password: str = field(default="", repr=False)


@dataclass(frozen=True, slots=True)
class Delivery:
    """How reports leave the service.

    Attributes
    ----------
    public_url : address of the service in links, without a slash at its end
    mail_server, sender : None and "" where no mail is sent
    domains : domains of recipients; empty: any
    origins : origins that webhooks may have, such as ``https://example.com:443``
    secret : key of their signatures
    language : of mails
    units : of the pictures in them, as `sprag_study.service.reading.quantities.read_units` takes them
    """

    public_url: str = "http://127.0.0.1:8000"
    mail_server: MailServer | None = None
    sender: str = ""
    domains: tuple[str, ...] = ()
    origins: tuple[str, ...] = ()
    secret: bytes | None = field(default=None, repr=False)
    language: str = ENGLISH
    units: str = "workshop"

    @property
    def wanted(self) -> bool:
        """Whether any report can leave."""
        return self.mail_server is not None or bool(self.origins)

    def reaches(self, target: str) -> bool:
        """Whether reports can go to ``target``, a mail address or the address of a webhook."""
        origin = origin_of(target)
        if origin is not None:
            return origin in self.origins
        return self.mail_server is not None and in_domains(target, self.domains)


class DeliverySettings(BaseSettings):
    """The settings of reports; a part of `sprag_study.service.settings.Settings`."""

    public_url: str = Field(
        default="",
        description="address at which people reach the service, such as `https://sprag.example`, for links in reports; "
        "without a path it gets that of `SPRAG_URL_PREFIX`; empty: host and port of the service; must be set where the "
        "host is `0.0.0.0` or `::`",
    )
    smtp_url: SecretStr | None = Field(
        default=None,
        description="mail server for reports: `smtps://user:password@host:465` (TLS), `smtp://...:587` (STARTTLS, "
        "required), or `smtp+plain://host:25` (neither TLS nor login, for a relay of this machine); empty: no mail",
    )
    mail_from: str = Field(validate_default=True, default="", description="address from which reports are sent")
    mail_language: str = Field(default=ENGLISH, description="language of the mails of schedules, such as `uk`")
    mail_domains: Annotated[tuple[str, ...], NoDecode] = Field(
        default=(), description="domains, separated by commas, to which reports may be mailed; empty: any"
    )
    webhook_origins: Annotated[tuple[str, ...], NoDecode] = Field(
        default=(),
        description="origins, separated by commas, to which webhooks may go, such as `https://hooks.example`; "
        "empty: none",
    )
    webhook_secret: SecretStr | None = Field(
        validate_default=True,
        default=None,
        description="key that signs webhooks: `whsec_` and 24 to 64 bytes in base64; needed with "
        "`SPRAG_WEBHOOK_ORIGINS`",
    )

    alert_to: Annotated[tuple[str, ...], NoDecode] = Field(
        validate_default=True,
        default=(),
        description="mail addresses and addresses of webhooks, separated by commas, that are told when the nightly "
        "backup fails or a disk fills; empty: administrators whose names are mail addresses",
    )

    @field_validator("public_url")
    @classmethod
    def _http_address(cls, value: str) -> str:
        if not value:
            return value
        place = urlsplit(value)
        if place.scheme not in _PORTS or not place.hostname or place.query or place.fragment or "@" in place.netloc:
            raise ValueError("an address is needed, such as https://sprag.example")
        return value.rstrip("/")

    @field_validator("smtp_url")
    @classmethod
    def _mail_server(cls, value: SecretStr | None) -> SecretStr | None:
        if value is not None:
            mail_server(value.get_secret_value())
        return value

    @field_validator("mail_from")
    @classmethod
    def _sender(cls, value: str, info: ValidationInfo) -> str:
        if not value and info.data.get("smtp_url") is not None:
            raise ValueError("SPRAG_SMTP_URL needs the address from which reports are sent")
        if value and not is_mail_address(value):
            raise ValueError("a mail address is needed, such as sprag@example.com")
        return value

    @field_validator("mail_language")
    @classmethod
    def _known_language(cls, value: str) -> str:
        if value not in available():
            raise ValueError(f"is not a language of this program; allowed: {', '.join(available())}")
        return value

    @field_validator("mail_domains", mode="before")
    @classmethod
    def _domains(cls, value: object) -> object:
        names = _texts(value)
        return value if names is None else tuple(name.lower() for name in names)

    @field_validator("webhook_origins", mode="before")
    @classmethod
    def _origins(cls, value: object) -> object:
        texts = _texts(value)
        if texts is None:
            return value
        found = []
        for text in texts:
            origin = origin_of(text)
            if origin is None or urlsplit(text).path.strip("/"):
                raise ValueError("origins are needed, such as https://hooks.example or http://10.0.0.5:8080")
            found.append(origin)
        return tuple(found)

    @field_validator("webhook_secret")
    @classmethod
    def _key(cls, value: SecretStr | None, info: ValidationInfo) -> SecretStr | None:
        if value is None and info.data.get("webhook_origins"):
            raise ValueError("SPRAG_WEBHOOK_ORIGINS needs the key that signs webhooks")
        if value is not None:
            secret_bytes(value.get_secret_value())
        return value

    @field_validator("alert_to", mode="before")
    @classmethod
    def _alerted(cls, value: object, info: ValidationInfo) -> object:
        texts = _texts(value)
        if texts is None:
            return value
        for text in texts:
            if not is_mail_address(text):
                if origin_of(text) not in info.data.get("webhook_origins", ()):
                    raise ValueError("mail addresses are needed, or addresses at SPRAG_WEBHOOK_ORIGINS")
            elif "smtp_url" in info.data and info.data["smtp_url"] is None:
                raise ValueError("mail addresses need a mail server (SPRAG_SMTP_URL)")
            elif not in_domains(text, info.data.get("mail_domains", ())):
                raise ValueError("mail addresses must have a domain of SPRAG_MAIL_DOMAINS")
        return tuple(texts)

    def delivery(self, own_url: str, prefix: str = "") -> Delivery:
        """How reports leave the service, whose address is ``own_url`` unless another is set; ``prefix`` is its path."""
        smtp, secret = self.smtp_url, self.webhook_secret
        public = self.public_url if urlsplit(self.public_url).path else self.public_url and self.public_url + prefix
        return Delivery(
            public or own_url,
            None if smtp is None else mail_server(smtp.get_secret_value()),
            self.mail_from,
            self.mail_domains,
            self.webhook_origins,
            None if secret is None else secret_bytes(secret.get_secret_value()),
            self.mail_language,
        )


def mail_server(url: str) -> MailServer:
    """The mail server of an address; raises ValueError, whose text does not have the password."""
    try:
        place = urlsplit(url)
        port = place.port
    except ValueError:
        raise ValueError("the mail server has no valid port") from None
    if place.scheme not in _SCHEMES or not place.hostname or place.path.strip("/") or place.query or place.fragment:
        raise ValueError("a mail server is needed as smtps://, smtp:// or smtp+plain://, host and port")
    security, usual = _SCHEMES[place.scheme]
    if security == "none" and place.username is not None:
        raise ValueError("smtp+plain:// would send the password in plain text; use smtp:// or smtps://")
    user = None if place.username is None else unquote(place.username)
    return MailServer(place.hostname, port or usual, security, user, unquote(place.password or ""))


def secret_bytes(text: str) -> bytes:
    """The key of a webhook secret; raises ValueError."""
    try:
        found = base64.b64decode(text.removeprefix(_SECRET_PREFIX), validate=True)
    except (binascii.Error, ValueError):
        found = b""
    if not text.startswith(_SECRET_PREFIX) or len(found) not in _SECRET_BYTES:
        raise ValueError("a key is needed: whsec_ and 24 to 64 bytes in base64")
    return found


def origin_of(url: str) -> str | None:
    """Scheme, host and port of an address of HTTP; None for anything else, and for one with a user or a fragment."""
    if not (url.isascii() and url.isprintable()) or any(letter in url for letter in ' "<>\\^`{|}'):
        return None
    try:
        place: SplitResult = urlsplit(url)
        port = place.port or _PORTS.get(place.scheme)
    except ValueError:
        return None
    if port is None or place.scheme not in _PORTS or not place.hostname or "@" in place.netloc or place.fragment:
        return None
    host = f"[{place.hostname}]" if ":" in place.hostname else place.hostname
    return f"{place.scheme}://{host.lower()}:{port}"


def in_domains(address: str, domains: tuple[str, ...]) -> bool:
    """Whether a mail address has one of the ``domains``; any has where there are none."""
    return not domains or address.rpartition("@")[2].lower() in domains


def is_mail_address(text: str) -> bool:
    """Whether ``text`` is a mail address of ASCII letters, without a name or comment."""
    local, at, domain = text.rpartition("@")
    labels = domain.split(".")
    return (
        bool(at)
        and len(text) <= 254
        and 1 <= len(local) <= 64
        and all(part and set(part) <= _ATOM for part in local.split("."))
        and all(1 <= len(label) <= 63 and set(label) <= _LABEL and label.strip("-") == label for label in labels)
    )


_LETTERS: Final = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789")
_LABEL: Final = _LETTERS | {"-"}
#: Without "%" and "!", by which some mail servers pass mail on to a further host.
_ATOM: Final = _LETTERS | set("#$&'*+/=?^_`{|}~-")


def _texts(value: object) -> list[str] | None:
    """The texts of a setting, without blanks: separated by commas, or a list of a file; None for anything else."""
    parts = value.split(",") if isinstance(value, str) else value
    if not isinstance(parts, list | tuple) or not all(isinstance(part, str) for part in parts):
        return None
    return [part.strip() for part in parts if part.strip()]
