"""What rows say: which runs passed, shares, differences and dependences, and how sure these are."""
