"""The digest of a study. Studies that are there have none: nobody knows whether their texts are right.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0039"
down_revision = "0038"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("studies", sa.Column("digest", sa.BigInteger))
