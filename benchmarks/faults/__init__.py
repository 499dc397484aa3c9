"""Faults done to the running program on purpose, and what becomes of its studies.

Each drill raises AssertionError when something is lost, doubled or wrong, and otherwise gives its figures.
"""
