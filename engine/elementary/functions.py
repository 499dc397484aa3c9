"""The elementary functions by number."""

#: Functions of one variable, and of two, by the numbers that compiled code has for them.
SIN, COS, TAN, ARCSIN, ARCCOS, ARCTAN, EXP, LOG, SINH, COSH, TANH = range(11)
ARCTAN2, POWER = range(2)
