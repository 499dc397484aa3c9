"""Processes that compute: one of them, many of them, and how they end."""
