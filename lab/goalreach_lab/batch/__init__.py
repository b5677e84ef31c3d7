"""Thousands of robots and learning phases at once."""
