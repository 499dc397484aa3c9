"""The part of a study's priority that counts against studies of other owners. Studies of before keep all of theirs.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0034"
down_revision = "0033"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("studies", sa.Column("rank", sa.Integer, nullable=False, server_default="0"))
    op.execute("UPDATE studies SET rank = priority")
