"""The variant of a study's model, replacing the number of pendulums, which only one model has.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0013"
down_revision = "0012"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("studies", sa.Column("variant", sa.String(40), nullable=False, server_default=""))
    studies = sa.table("studies", sa.column("pendulums", sa.Integer), sa.column("variant", sa.String))
    number = sa.cast(studies.c.pendulums, sa.String(40))
    op.get_bind().execute(sa.update(studies).where(studies.c.pendulums > 0).values(variant=number))
    op.drop_column("studies", "pendulums")
