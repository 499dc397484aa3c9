"""Schedules, their due times and reports."""
