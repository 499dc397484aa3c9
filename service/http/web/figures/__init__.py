"""Figures that plotly draws in the browser: curves, motions, shafts, clutch fits."""
