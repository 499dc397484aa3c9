"""The machine shaft: a machine of one degree of freedom reduced to its main shaft, and the irregularity of its speed
(docs/theory-machine-shaft.md).
"""
