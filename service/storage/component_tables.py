"""The table of the office's own components. Times are microseconds since 1970-01-01 UTC."""

import sqlalchemy as sa

from sprag.service.storage.tables import METADATA

COMPONENTS = sa.Table(
    "components",
    METADATA,
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=True),
    sa.Column("id", sa.String(40), nullable=False, unique=True),
    sa.Column("kind", sa.String(16), nullable=False),
    sa.Column("name", sa.Text, nullable=False),
    sa.Column("note", sa.Text, nullable=False),
    # Its fields as JSON: names and quantities as somebody wrote them.
    sa.Column("fields", sa.Text, nullable=False),
    sa.Column("changed_at", sa.BigInteger, nullable=False),
    # Name of the user who added it; NULL: nobody's, so every designer may change it.
    sa.Column("owner", sa.String(80)),
    sa.UniqueConstraint("kind", "name", name="uq_components_kind_name"),
    sqlite_autoincrement=True,
)
