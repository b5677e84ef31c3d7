"""Recorder, player and recomputation on a running graph."""
