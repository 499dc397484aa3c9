"""Studies that begin by themselves: when they are due, what is kept of them, and who submits them."""
