"""Bringing the graph up, watching it drive, and taking it down."""
