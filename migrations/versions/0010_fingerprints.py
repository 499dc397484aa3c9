"""The code, libraries and processor that computed the rows of a study.

For existing rows they are unknown (""): these rows are kept, but no other study reuses them.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("studies", sa.Column("fingerprint", sa.String(64)))
    studies = sa.table("studies", sa.column("done", sa.Integer), sa.column("fingerprint", sa.String))
    op.get_bind().execute(sa.update(studies).where(studies.c.done > 0).values(fingerprint=""))
