"""Scheduled studies: their fields, times and deadlines."""
