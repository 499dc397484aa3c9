"""What the dispatcher does: claims, results, rounds, and room for them."""
