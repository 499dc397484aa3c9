"""Settings of the login at an OpenID provider."""

from __future__ import annotations

from typing import Annotated, Final
from urllib.parse import urlsplit

from pydantic import Field, SecretStr, ValidationInfo, field_validator
from pydantic_settings import BaseSettings, NoDecode

from sprag_study.hosts import is_loopback
from sprag_study.service.actor import Role

#: In place of a group: everybody who can log in at the provider.
EVERYBODY: Final = "*"


class OidcSettings(BaseSettings):
    """The settings of the login at an OpenID provider; a part of `sprag_study.service.settings.Settings`."""

    oidc_issuer: str = Field(
        default="",
        description="issuer of the OpenID provider at which people log in on pages, such as "
        "`https://login.example/realms/office`; needs the extra `oidc`; empty: none",
    )
    oidc_client_id: str = Field(
        default="", validate_default=True, max_length=200, description="id of Sprag as a client of the provider"
    )
    oidc_client_secret: SecretStr | None = Field(
        default=None, description="secret of this client; empty: a public client, which PKCE alone protects"
    )
    oidc_scopes: str = Field(
        default="openid profile email",
        max_length=200,
        pattern="^openid( [!#-\\[\\]-~]+)*$",
        description="scopes that are asked for; some providers give groups with a scope `groups` only",
    )
    oidc_name_claim: str = Field(
        default="preferred_username",
        min_length=1,
        max_length=200,
        description="claim with the name of the user at the first login; `email` must be verified by the provider",
    )
    oidc_groups_claim: str = Field(
        default="groups",
        min_length=1,
        max_length=200,
        description="claim with the groups of a user; a dot leads into an object, such as `realm_access.roles`",
    )
    oidc_roles: Annotated[tuple[str, ...], NoDecode] = Field(
        default=(),
        description="roles of groups, separated by commas, such as `cad=designer,it=administrator`; `*=viewer` is for "
        "everybody. The highest one holds from each login on, and who has none is refused; empty: roles as "
        "administrators give them",
    )
    oidc_create: bool = Field(
        default=False,
        validate_default=True,
        description="whether the first login makes a user, with the role that `SPRAG_OIDC_ROLES` gives",
    )

    @field_validator("oidc_issuer")
    @classmethod
    def _issuer(cls, value: str) -> str:
        if value and not is_safe_address(value):
            raise ValueError("an https address without query and fragment is needed; http of this machine only")
        return value

    @field_validator("oidc_client_id")
    @classmethod
    def _client(cls, value: str, info: ValidationInfo) -> str:
        if not value and info.data.get("oidc_issuer"):
            raise ValueError("SPRAG_OIDC_ISSUER needs the id of the client")
        return value

    @field_validator("oidc_roles", mode="before")
    @classmethod
    def _roles(cls, value: object) -> object:
        texts = value.split(",") if isinstance(value, str) else value
        if not isinstance(texts, list | tuple) or not all(isinstance(text, str) for text in texts):
            return value
        pairs = tuple(text.strip() for text in texts if text.strip())
        for pair in pairs:
            group, equals, role = pair.rpartition("=")
            if not (equals and group.strip() and role.strip() in set(Role)):
                raise ValueError(f"group=role is needed, with a role of {', '.join(Role)}, such as cad=designer")
        return pairs

    @field_validator("oidc_create")
    @classmethod
    def _needs_roles(cls, value: bool, info: ValidationInfo) -> bool:
        if value and info.data.get("oidc_roles") == ():
            raise ValueError("SPRAG_OIDC_CREATE needs SPRAG_OIDC_ROLES, which say what new users may do")
        return value

    def role_of(self, groups: tuple[str, ...]) -> Role | None:
        """The highest role that these groups give; None where they give none."""
        pairs = [pair.rpartition("=") for pair in self.oidc_roles]
        given = {role.strip() for group, _, role in pairs if group.strip() in (*groups, EVERYBODY)}
        return next((role for role in reversed(Role) if role in given), None)


def is_safe_address(url: str) -> bool:
    """Whether nobody can read or change what is sent to an address: that of https, or of this machine."""
    try:
        place = urlsplit(url)
        host = place.hostname or ""
        usable = bool(host) and place.port != 0
    except ValueError:
        return False
    if not usable or "@" in place.netloc or place.fragment or not (url.isascii() and url.isprintable()):
        return False
    return place.scheme == "https" or (place.scheme == "http" and is_loopback(host))
