"""Figures, described once; the painters of pictures and of pages draw the same description."""
