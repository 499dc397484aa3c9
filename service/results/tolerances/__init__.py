"""What a batch of drives does: quantile curves, yield, the tolerances that they are owed to, the worst drives."""
