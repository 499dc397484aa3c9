"""Deliberate faults in the running program, and their effect on its studies.

Each drill raises AssertionError when something is lost, doubled or wrong, and otherwise gives its figures.
"""
