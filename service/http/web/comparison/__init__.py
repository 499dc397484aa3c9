"""Several studies side by side: what is compared, the answer, and the curves."""
