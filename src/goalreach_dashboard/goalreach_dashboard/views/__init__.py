"""What the live page shows, as pure functions of its state."""
