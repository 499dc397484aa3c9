"""Settings of the service and the worker: one table of names, defaults and help, read from environment and file.

Every setting is an environment variable with the prefix ``SPRAG_``, and a field of the TOML file named by the variable
``SPRAG_SETTINGS``; the environment takes precedence. The documentation's table is generated from `table`.
"""

import os
import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from ipaddress import IPv4Network, IPv6Network
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import platformdirs
from pydantic import Field, SecretStr, field_validator
from pydantic_settings import (
    BaseSettings,
    InitSettingsSource,
    NoDecode,
    PydanticBaseSettingsSource,
    SettingsConfigDict,
)

from sprag_study.hosts import is_loopback
from sprag_study.service.delivery import Delivery, DeliverySettings, origin_of
from sprag_study.service.oidc import OidcSettings
from sprag_study.service.zones import zones

ENV_PREFIX = "SPRAG_"
#: What precedes the password of an address, and the password: before the last "@", or among the options.
_USER = re.compile(r"(://[^:@/]*:).*@")
_OPTION = re.compile(r"([?&]password=)[^&]*")
FILE_VARIABLE = "SPRAG_SETTINGS"
MIN_TOKEN_LENGTH = 16
LOOPBACK_HOSTS = ("localhost", "127.0.0.1", "[::1]")


class UnsafeSettingsError(Exception):
    """The settings would expose the service to other machines without protection."""


class SettingsFileError(Exception):
    """The file of settings cannot be read; the message is one sentence."""


class Settings(DeliverySettings, OidcSettings):
    """Every setting with its default and its help; see `table`."""

    model_config = SettingsConfigDict(
        env_prefix=ENV_PREFIX, env_ignore_empty=True, frozen=True, extra="ignore", hide_input_in_errors=True
    )

    database: str = Field(
        default="",
        description=(
            "path of an SQLite file, or a SQLAlchemy URL of one or of a PostgreSQL server "
            "(`postgresql://user@host/sprag`); empty: `sprag.sqlite3` in the user's data directory"
        ),
    )
    host: str = Field(
        default="127.0.0.1",
        description="address the service listens on; one that other machines can reach needs a token",
    )
    port: int = Field(default=8000, ge=0, le=65535, description="port the service listens on; 0: any free one")
    tls_certificate: str = Field(
        default="",
        description="PEM file with the service's certificate and those of its issuers, for TLS without a proxy; empty: "
        "plain HTTP",
    )
    tls_key: str = Field(
        default="", description="PEM file with the key of `SPRAG_TLS_CERTIFICATE`; empty: it is in the same file"
    )
    token: SecretStr | None = Field(
        default=None,
        description=(
            f"secret of at least {MIN_TOKEN_LENGTH} characters that every request must carry as "
            "`Authorization: Bearer`; browsers log in with it"
        ),
    )
    allowed_hosts: Annotated[tuple[str, ...], NoDecode] = Field(
        default=(),
        description="host names, separated by commas, that clients may use besides localhost and the host",
    )
    url_prefix: str = Field(
        default="",
        max_length=200,
        pattern="^(/[A-Za-z0-9_-]+)*$",
        description="path at which a proxy serves the service, such as `/sprag`; empty: the whole host",
    )
    trusted_proxies: Annotated[tuple[IPv4Network | IPv6Network, ...], NoDecode] = Field(
        default=(IPv4Network("127.0.0.1/32"), IPv6Network("::1/128")),
        description=(
            "addresses or networks, separated by commas, of proxies whose `X-Forwarded-For` is trusted, and the "
            "header of `SPRAG_USER_HEADER`"
        ),
    )
    user_header: str = Field(
        default="",
        pattern="^[A-Za-z0-9-]{0,64}$",
        description="header in which a trusted proxy names the user that it has logged in, such as `X-Forwarded-User`; "
        "empty: none",
    )
    user_role: Literal["", "viewer", "designer", "administrator"] = Field(
        default="",
        description="role of users whom the proxy names and `sprag admin user` does not list; empty: they are refused",
    )
    user_cases: int = Field(
        default=0, ge=0, le=2**63 - 1, description="cases of one user that may wait at the same time; 0: no limit"
    )
    user_storage: int = Field(
        default=0, ge=0, le=2**43 - 1, description="MiB that the results of one user may take, estimated; 0: no limit"
    )
    user_checks: int = Field(
        default=0,
        ge=0,
        le=64,
        description="checks of specs, fits and pictures of one user that run at the same time; 0: all but one of "
        "`SPRAG_CHECK_PROCESSES`",
    )
    user_tokens: int = Field(
        default=50, ge=0, le=100_000, description="valid tokens that one user may have; 0: no limit"
    )
    processes: int = Field(default=0, ge=0, le=1024, description="processes of the pool; 0: one for each core")
    executor: str = Field(
        default="pool",
        description=(
            "where chunks run: `pool`, processes of the worker; `dask`, a Dask cluster of its own on this machine; "
            "`dask://host:port`, the scheduler of a cluster"
        ),
    )
    chunk_cases: int = Field(
        default=0, ge=0, le=1_000_000, description="cases that one process takes at a time; 0: about a second of work"
    )
    chunk_timeout: float = Field(
        default=600.0,
        gt=0.0,
        le=86_400.0,
        description="seconds of processor time after which a chunk is killed; one that hangs without using any "
        "is killed after ten times as long",
    )
    stop_seconds: float = Field(
        default=30.0,
        ge=10.0,
        le=3_600.0,
        description="seconds after SIGTERM at which the service exits in any case; at half of them a worker that has "
        "not ended is killed",
    )
    trajectory_timeout: float = Field(
        default=60.0,
        gt=0.0,
        le=3_600.0,
        description="seconds of processor time after which the computation of instantaneous values is ended",
    )
    check_processes: int = Field(
        default=2,
        ge=1,
        le=64,
        description="processes that check specs, fit clutches and draw; one token can use all but one of them",
    )
    check_timeout: float = Field(
        default=20.0,
        gt=0.0,
        le=3_600.0,
        description=(
            "seconds of processor time after which the check of a spec, a fit or a picture is ended; loading is not "
            "counted"
        ),
    )
    check_memory: int = Field(
        default=512, ge=64, le=1_048_576, description="MiB that the check of a spec, a fit or a picture may use"
    )

    log_format: Literal["text", "json"] = Field(
        default="text", description="form of the log: `text` for people, `json` for machines"
    )
    log_requests: bool = Field(default=False, description="a line in the log for every request")
    backup_folder: str = Field(
        default="", description="folder to which the worker writes a backup of the database every night; empty: none"
    )
    backup_keep: int = Field(default=14, ge=1, le=10_000, description="backups that are kept, the latest ones")
    disk_free: int = Field(
        default=1024,
        ge=0,
        le=2**40,
        description="MiB that should be free on the disks of the database and the backups; administrators are told "
        "when less is; 0: they are not watched",
    )
    keep_days: int = Field(
        default=0, ge=0, le=36_500, description="days after which a study that has ended is deleted; 0: never"
    )
    restore_days: int = Field(
        default=7,
        ge=0,
        le=36_500,
        description="days for which a study that somebody deleted can be restored, and takes room on the disk; 0: none",
    )
    report_office: str = Field(default="", description="name of the office in the title block of reports")
    report_folder: str = Field(
        default="",
        description="folder with the office's own `report.typ`, `report.html`, `logo.svg` or `logo.png` and fonts for "
        "reports; empty: the templates of the program",
    )
    audit_days: int = Field(default=0, ge=0, le=36_500, description="days for which the audit log is kept; 0: for ever")
    nightly_at: str = Field(default="02:30", description="time of day for the backup and for deleting old studies")
    zone: str = Field(
        default="UTC",
        description="time zone of the office, such as `Europe/Berlin`: of `SPRAG_NIGHTLY_AT`, and of pages until a "
        "browser says its own",
    )
    units: str = Field(
        default="workshop",
        description="units of mails, and of pages and documents until somebody chooses others: `workshop` (rpm, mm, "
        "deg, %), `typed` (those of each study), `si`, or a list such as `workshop,N*mm`",
    )

    @classmethod
    def settings_customise_sources(
        cls,
        settings_cls: type[BaseSettings],
        init_settings: PydanticBaseSettingsSource,
        env_settings: PydanticBaseSettingsSource,
        dotenv_settings: PydanticBaseSettingsSource,  # noqa: ARG003 - pydantic names them
        file_secret_settings: PydanticBaseSettingsSource,  # noqa: ARG003
    ) -> tuple[PydanticBaseSettingsSource, ...]:
        """Precedence: options, environment, the file named by SPRAG_SETTINGS."""
        return init_settings, env_settings, InitSettingsSource(settings_cls, read_file(settings_cls))

    @field_validator("nightly_at")
    @classmethod
    def _time_of_day(cls, value: str) -> str:
        if re.fullmatch(r"([01]?[0-9]|2[0-3]):[0-5][0-9]", value) is None:
            raise ValueError("a time of day is needed, such as 02:30")
        return value

    @field_validator("zone")
    @classmethod
    def _known_zone(cls, value: str) -> str:
        if value not in zones():
            raise ValueError("the name of a time zone is needed, such as Europe/Berlin")
        return value

    @field_validator("units")
    @classmethod
    def _known_units(cls, value: str) -> str:
        if value not in {"workshop", "typed", "si"}:
            from sprag_study.service.faults import SelectionError
            from sprag_study.service.reading.quantities import read_units

            try:
                read_units(value)
            except SelectionError as error:
                raise ValueError(str(error)) from None
        return value

    @field_validator("allowed_hosts", "trusted_proxies", mode="before")
    @classmethod
    def _split_hosts(cls, value: object) -> object:
        if isinstance(value, str):
            return tuple(name.strip() for name in value.split(",") if name.strip())
        return value

    @field_validator("executor")
    @classmethod
    def _known_executor(cls, value: str) -> str:
        found = re.fullmatch(r"pool|dask|dask://(\[[0-9a-fA-F:]+\]|[^\s:/@]+):([0-9]{1,5})", value)
        if not found or (found[2] and not 1 <= int(found[2]) <= 65_535):
            raise ValueError("must be pool, dask, or dask://host:port, with a port of 1 to 65535")
        return value

    @field_validator("token")
    @classmethod
    def _long_enough(cls, value: SecretStr | None) -> SecretStr | None:
        if value is None:
            return None
        text = value.get_secret_value()
        if len(text) < MIN_TOKEN_LENGTH or not text.isascii() or any(c.isspace() for c in text):
            raise ValueError(f"a token needs at least {MIN_TOKEN_LENGTH} ASCII characters without blanks")
        return value

    @property
    def database_url(self) -> str:
        """The database as a SQLAlchemy URL."""
        if "://" in self.database:
            return self.database
        path = Path(self.database) if self.database else default_database_path()
        return f"sqlite:///{path.expanduser().absolute()}"

    @property
    def pool_processes(self) -> int:
        """Number of pool processes, at least 1."""
        return self.processes or available_cores()

    @property
    def loopback(self) -> bool:
        """Whether only this machine can reach the service."""
        return is_loopback(self.host)

    @property
    def host_names(self) -> frozenset[str]:
        """The allowed host names of requests, in lower case and without port."""
        host = self.host.lower()
        own = f"[{host}]" if ":" in host and not host.startswith("[") else host
        return frozenset({*LOOPBACK_HOSTS, own, *(name.lower() for name in self.allowed_hosts)})

    def address(self, port: int) -> str:
        """The address at which the service answers on ``port``, with its prefix and without a final slash."""
        host = self.host.strip("[]")
        scheme = "https" if self.tls_certificate else "http"
        return f"{scheme}://{f'[{host}]' if ':' in host else host}:{port}{self.url_prefix}"

    @property
    def reports(self) -> Delivery:
        """How reports leave the service; without a public address their links have the host and port of it."""
        return replace(self.delivery(self.address(self.port), self.url_prefix), units=self.units)

    def require_safe(self, *, stored: bool = False) -> None:
        """Raise `UnsafeSettingsError` when another machine could reach the service and there is no token, no proxy
        logs users in (SPRAG_USER_HEADER), and no OpenID provider does (SPRAG_OIDC_ISSUER).

        ``stored`` states whether the database has one.
        """
        if not (self.loopback or self.token is not None or self.user_header or self.oidc_issuer or stored):
            raise UnsafeSettingsError(
                f"The host {self.host} can be reached from other machines, so the service needs a token: "
                f"`sprag admin token create` makes one, or set {ENV_PREFIX}TOKEN."
            )


def read_file(settings_cls: type[BaseSettings]) -> dict[str, Any]:
    """The settings in the file named by the environment; raises SettingsFileError."""
    name = os.environ.get(FILE_VARIABLE, "")
    if not name:
        return {}
    try:
        with Path(name).open("rb") as file:
            found = tomllib.load(file)
    except OSError as error:
        raise SettingsFileError(f"The settings {name} ({FILE_VARIABLE}) cannot be read: {error.strerror}.") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SettingsFileError(f"The settings {name} ({FILE_VARIABLE}) are not valid TOML: {error}.") from None
    unknown = [key for key in found if key not in settings_cls.model_fields]
    if unknown:
        known = ", ".join(settings_cls.model_fields)
        raise SettingsFileError(f"The settings {name} have an unknown field {unknown[0]!r}; known are: {known}.")
    return found


def is_secret(name: str) -> bool:
    """Whether the value of a setting must not be shown."""
    field = Settings.model_fields.get(name)
    return field is not None and "SecretStr" in str(field.annotation)


def available_cores() -> int:
    """Number of cores this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not Linux
        return os.cpu_count() or 1


def default_database_path() -> Path:
    """Default path of the database."""
    return Path(platformdirs.user_data_dir("sprag", appauthor=False)) / "sprag.sqlite3"


@dataclass(frozen=True, slots=True)
class SettingRow:
    """One row of the table of settings: environment variable, default as text, help."""

    variable: str
    default: str
    help: str


def table() -> Iterator[SettingRow]:
    """The table of settings, one row each, in order of declaration."""
    for name, field in Settings.model_fields.items():
        yield SettingRow(f"{ENV_PREFIX}{name.upper()}", shown(field.default), field.description or "")


def shown(default: Any) -> str:
    """A value as text, without the password of an address."""
    if default is None or default in ("", ()):
        return ""
    if isinstance(default, tuple):
        return ",".join(map(str, default))
    if isinstance(default, str):
        return _OPTION.sub(r"\1***", _USER.sub(r"\1***@", default))
    return f"{default:g}" if isinstance(default, float) else str(default)


@dataclass(frozen=True, slots=True)
class EffectiveSetting:
    """A setting, or a variable of commands, with its value as text and where it comes from; a secret is not shown."""

    name: str
    value: str
    origin: str


#: Origins that are no variable and no file, and what stands for a secret.
DEFAULT_ORIGIN: Final = "default"
OPTION_ORIGIN: Final = "option"
HIDDEN: Final = "(secret)"


def effective(settings: Settings) -> Iterator[EffectiveSetting]:
    """Every setting that applies in this process, in order of declaration."""
    file, environment = read_file(Settings), {name.upper() for name, value in os.environ.items() if value}
    for name, field in Settings.model_fields.items():
        value, variable = getattr(settings, name), f"{ENV_PREFIX}{name.upper()}"
        origin = DEFAULT_ORIGIN if value == field.default else OPTION_ORIGIN
        if variable in environment or name in file:
            origin = variable if variable in environment else os.environ[FILE_VARIABLE]
        if name == "database" and not value:
            value = str(default_database_path())
        if name == "alert_to":  # the path of a webhook can be a secret of its receiver
            value = tuple(origin_of(target) or target for target in value)
        yield EffectiveSetting(name, HIDDEN if isinstance(value, SecretStr) else shown(value), origin)
