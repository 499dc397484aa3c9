"""The hash shared by studies with a common case, whether a study runs every case, and how many cases it reused.

Self-contained: it must do the same on the day it is run as on the day it was written.
"""

import hashlib
import json

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("studies", sa.Column("kin_hash", sa.String(64), nullable=False, server_default=""))
    op.add_column("studies", sa.Column("fresh", sa.Integer, nullable=False, server_default="0"))
    op.add_column("studies", sa.Column("reused", sa.Integer, nullable=False, server_default="0"))
    op.create_index("ix_studies_kin_hash", "studies", ["kin_hash"])
    studies = sa.table(
        "studies",
        sa.column("number", sa.Integer),
        sa.column("study", sa.Text),
        sa.column("engine_version", sa.String),
        sa.column("kin_hash", sa.String),
    )
    connection = op.get_bind()
    numbers = connection.execute(sa.select(studies.c.number)).scalars().all()
    for number in numbers:
        text, engine = connection.execute(
            sa.select(studies.c.study, studies.c.engine_version).where(studies.c.number == number)
        ).one()
        connection.execute(
            sa.update(studies).where(studies.c.number == number).values(kin_hash=_kin_hash(json.loads(text), engine))
        )


def _kin_hash(study: dict[str, object], engine: str) -> str:
    axes = study["axes"]
    base = study["base"]
    assert isinstance(axes, list)
    assert isinstance(base, dict)
    paths = sorted({*base, *(path for axis in axes for path in axis["paths"])})
    text = json.dumps(
        {"engine": engine, "model": study["model"], "run": study["run"], "paths": paths},
        sort_keys=True,
        separators=(",", ":"),
        allow_nan=False,
    )
    return hashlib.sha256(text.encode("ascii")).hexdigest()
