"""The vibration drive: pendulums on a vibrating axis that turn an output shaft through freewheel clutches
(docs/theory.md).
"""
