"""One self-contained file for each revision of the database."""
