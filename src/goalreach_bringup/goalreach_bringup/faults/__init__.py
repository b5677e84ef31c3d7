"""Faults injected into a live stack, what should come of each, and what did."""
