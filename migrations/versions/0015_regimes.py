"""An index by regime of the results of settled studies: for counting and selecting cases by regime.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

from alembic import op

revision = "0015"
down_revision = "0014"
branch_labels = None
depends_on = None


def upgrade() -> None:
    for pendulums in range(1, 9):
        name = f"vibration_drive_{pendulums}_settled"
        op.create_index(f"ix_{name}_regime", name, ["study", "regime", "case_number"])
