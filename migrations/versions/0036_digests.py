"""The digest of the rows of a chunk. Chunks that are there have none: nobody knows whether their rows are right.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0036"
down_revision = "0035"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("chunks", sa.Column("digest", sa.BigInteger))
