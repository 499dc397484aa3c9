"""Where the data lie: an SQLite file or a PostgreSQL server."""
