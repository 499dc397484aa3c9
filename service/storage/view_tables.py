"""The table of saved views. Times are microseconds since 1970-01-01 UTC."""

import sqlalchemy as sa

from sprag.service.storage.tables import METADATA

SAVED_VIEWS = sa.Table(
    "saved_views",
    METADATA,
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=True),
    sa.Column("id", sa.String(40), nullable=False, unique=True),
    # NULL: of a page that belongs to no study.
    sa.Column("study", sa.Integer, sa.ForeignKey("studies.number"), index=True),
    sa.Column("page", sa.String(16), nullable=False),
    # Unique among the views of a page of a study: a view that is saved under the same name replaces the old one.
    sa.Column("name", sa.Text, nullable=False),
    # The choices as the query of the page's address.
    sa.Column("query", sa.Text, nullable=False),
    # Position in the report of the study; NULL: not in it.
    sa.Column("place", sa.Integer),
    sa.Column("changed_at", sa.BigInteger, nullable=False),
    # Name of the user who saved it; NULL: nobody's, so every designer may change it.
    sa.Column("owner", sa.String(80)),
    sqlite_autoincrement=True,
)
