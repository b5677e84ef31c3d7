"""Verbs of the `ros2` commands that need a node."""
