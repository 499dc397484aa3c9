"""Taylor-series integration of many cases at once: recurrences, generated kernels, roots and extrema of polynomials."""
