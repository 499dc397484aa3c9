"""Settings of the service and the worker: one table of names, defaults and help, read from the environment.

Every setting is an environment variable with the prefix ``SPRAG_``; the documentation's table is made from `table`.
"""

import ipaddress
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import platformdirs
from pydantic import Field, SecretStr, field_validator
from pydantic_settings import BaseSettings, NoDecode, SettingsConfigDict

ENV_PREFIX = "SPRAG_"
MIN_TOKEN_LENGTH = 16
LOOPBACK_HOSTS = ("localhost", "127.0.0.1", "[::1]")


class UnsafeSettingsError(Exception):
    """The settings would open the service to other machines without protection."""


class Settings(BaseSettings):
    """Every setting with its default and its help; see `table`."""

    model_config = SettingsConfigDict(env_prefix=ENV_PREFIX, env_ignore_empty=True, frozen=True, extra="ignore")

    database: str = Field(
        default="",
        description=("path of an SQLite file or a SQLAlchemy URL; empty: `sprag.sqlite3` in the user's data directory"),
    )
    host: str = Field(
        default="127.0.0.1",
        description="address the service listens on; one that other machines can reach needs a token",
    )
    port: int = Field(default=8000, ge=0, le=65535, description="port the service listens on; 0: any free one")
    token: SecretStr | None = Field(
        default=None,
        description=(
            f"secret of at least {MIN_TOKEN_LENGTH} characters that every request must carry as "
            "`Authorization: Bearer`; pages in a browser take it as the password"
        ),
    )
    allowed_hosts: Annotated[tuple[str, ...], NoDecode] = Field(
        default=(),
        description="names, separated by commas, by which clients may call the service beside localhost and the host",
    )
    processes: int = Field(default=0, ge=0, le=1024, description="processes of the pool; 0: one for each core")
    chunk_cases: int = Field(
        default=0, ge=0, le=1_000_000, description="cases that one process takes at a time; 0: about a second of work"
    )
    chunk_timeout: float = Field(
        default=600.0, gt=0.0, le=86_400.0, description="seconds after which a chunk that does not come back is killed"
    )
    trajectory_timeout: float = Field(
        default=60.0,
        gt=0.0,
        le=3_600.0,
        description="seconds after which the instantaneous values of a case are given up",
    )

    @field_validator("allowed_hosts", mode="before")
    @classmethod
    def _split_hosts(cls, value: object) -> object:
        if isinstance(value, str):
            return tuple(name.strip() for name in value.split(",") if name.strip())
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
        if self.host == "localhost":
            return True
        try:
            return ipaddress.ip_address(self.host.strip("[]")).is_loopback
        except ValueError:
            return False

    @property
    def host_names(self) -> frozenset[str]:
        """The host names, lower case and without port, that a request may be addressed to."""
        host = self.host.lower()
        own = f"[{host}]" if ":" in host and not host.startswith("[") else host
        return frozenset({*LOOPBACK_HOSTS, own, *(name.lower() for name in self.allowed_hosts)})

    def require_safe(self, *, stored: bool = False) -> None:
        """Raise `UnsafeSettingsError` when another machine could reach the service and there is no token.

        ``stored`` tells whether the database has one.
        """
        if not self.loopback and self.token is None and not stored:
            raise UnsafeSettingsError(
                f"The host {self.host} can be reached from other machines, so the service needs a token: "
                f"`sprag token create` makes one, or set {ENV_PREFIX}TOKEN."
            )


def available_cores() -> int:
    """Number of cores this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not Linux
        return os.cpu_count() or 1


def default_database_path() -> Path:
    """Where the database lies unless a setting says otherwise."""
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
        yield SettingRow(f"{ENV_PREFIX}{name.upper()}", _shown(field.default), field.description or "")


def _shown(default: Any) -> str:
    if default is None or default in ("", ()):
        return ""
    return f"{default:g}" if isinstance(default, float) else str(default)
