"""The values of reasons beside their English. Reasons that are there have none; they are read as before.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0040"
down_revision = "0039"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("studies", sa.Column("reason_values", sa.Text))
    op.add_column("schedule_runs", sa.Column("problem_values", sa.Text))
