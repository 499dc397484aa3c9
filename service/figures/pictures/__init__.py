"""Pictures that matplotlib draws: SVG, PNG, PDF."""
