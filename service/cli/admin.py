"""``sprag admin``: users, tokens, the audit log, the database, workers, and what is wrong with an installation."""

from __future__ import annotations

import typer

from sprag_study.service.cli import audit, database, doctor, health, processes, token, user, workers
from sprag_study.service.cli.described import listing
from sprag_study.service.cli.groups import Groups
from sprag_study.service.cli.options import Database

app = typer.Typer(
    help="Users, tokens, the database, workers, and checks of the installation.", no_args_is_help=True, cls=Groups
)
app.callback()(listing(db=Database))
app.command("doctor")(doctor.doctor)
app.command("health")(health.health)
app.command("metrics")(health.metrics)
app.command("audit")(audit.audit)
app.command("worker")(processes.worker)
app.command("workers")(workers.workers)
app.add_typer(database.app, name="db")
app.add_typer(token.app, name="token")
app.add_typer(user.app, name="user")
