"""Branches of periodic orbits: continuation of fixed points of a return map along one parameter.

The map is anything that satisfies `problem.ReturnMap`. All linear algebra is done in fixed order on Python numbers, so
that a branch has the same bits on every machine.
"""
