"""Revisions of the database, run by `sprag db upgrade`."""
