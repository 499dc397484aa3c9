"""What the dispatcher reports of its workers, and which host computed a chunk.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0022"
down_revision = "0021"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("dispatcher", sa.Column("report", sa.Text))
    op.add_column("chunks", sa.Column("host", sa.String(255)))
    op.add_column("chunks", sa.Column("fingerprint", sa.String(64)))
