"""Clocks and publishers of the `nomad200` node."""
