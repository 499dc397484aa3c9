"""The machine shaft: a machine of one degree of freedom reduced to its main shaft, and the unevenness of its turning
(docs/theory-machine-shaft.md).
"""
