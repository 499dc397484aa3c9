"""To whom schedules report, and the reports that are to be sent. Schedules of before report to nobody.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import sqlalchemy as sa
from alembic import op

revision = "0027"
down_revision = "0026"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("schedules", sa.Column("report_email", sa.Text, nullable=False, server_default=""))
    op.add_column("schedules", sa.Column("report_webhook", sa.Text))
    op.add_column("schedules", sa.Column("report_when", sa.String(8), nullable=False, server_default="always"))
    op.create_table(
        "reports",
        sa.Column("number", sa.Integer, autoincrement=True),
        sa.Column("id", sa.String(40), nullable=False),
        sa.Column("schedule", sa.Integer, nullable=False),
        sa.Column("due", sa.BigInteger, nullable=False),
        sa.Column("kind", sa.String(12), nullable=False),
        sa.Column("channel", sa.String(12), nullable=False),
        sa.Column("target", sa.String(500), nullable=False),
        sa.Column("content", sa.Text, nullable=False),
        sa.Column("state", sa.String(12), nullable=False),
        sa.Column("attempts", sa.Integer, nullable=False),
        sa.Column("next_try", sa.BigInteger, nullable=False),
        sa.Column("claimed_until", sa.BigInteger),
        sa.Column("created_at", sa.BigInteger, nullable=False),
        sa.Column("ended_at", sa.BigInteger),
        sa.Column("problem", sa.Text),
        sa.PrimaryKeyConstraint("number", name="pk_reports"),
        sa.UniqueConstraint("id", name="uq_reports_id"),
        sa.UniqueConstraint("schedule", "due", "kind", "channel", "target", name="uq_reports_schedule"),
        sa.ForeignKeyConstraint(["schedule"], ["schedules.number"], name="fk_reports_schedule"),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_reports_state_next_try", "reports", ["state", "next_try"])
    op.create_index("ix_reports_due", "reports", ["due"])
