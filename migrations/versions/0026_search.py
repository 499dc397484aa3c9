"""What studies are searched for and sorted by name in: their texts without case and accents.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import unicodedata

import sqlalchemy as sa
from alembic import op

revision = "0026"
down_revision = "0025"
branch_labels = None
depends_on = None

STUDIES = sa.table("studies", sa.column("number", sa.Integer), sa.column("name", sa.Text), sa.column("search", sa.Text))


def upgrade() -> None:
    op.add_column("studies", sa.Column("search", sa.Text, nullable=False, server_default=""))
    connection = op.get_bind()
    for number, name in connection.execute(sa.select(STUDIES.c.number, STUDIES.c.name)).all():
        # No study of these revisions has notes or tags.
        text = f"{_folded(name)}\n\n"
        connection.execute(sa.update(STUDIES).where(STUDIES.c.number == number).values(search=text))


def _folded(text: str) -> str:
    plain = "".join(sign for sign in unicodedata.normalize("NFKD", text) if not unicodedata.combining(sign))
    return " ".join(plain.casefold().split())
