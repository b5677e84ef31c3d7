"""Sweeps over seeds, noise and arenas, on this machine or on many."""
