"""Axes of a study: values, points, samples, combinations, exclusions."""
