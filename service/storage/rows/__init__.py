"""Rows of finished cases: read, looked over, found again for other studies."""
