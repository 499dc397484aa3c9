"""The rows of a study on one page: conditions, a plot, a table, and the chosen row beside them."""
