"""Notes, tags and archiving of studies, and the time at which the rows of a deleted one are removed.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0023"
down_revision = "0022"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("studies", sa.Column("notes", sa.Text, nullable=False, server_default=""))
    op.add_column("studies", sa.Column("tags", sa.Text, nullable=False, server_default=""))
    op.add_column("studies", sa.Column("archived_at", sa.BigInteger))
    op.add_column("studies", sa.Column("purge_at", sa.BigInteger))
