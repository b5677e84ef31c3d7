"""Listening to a robot, and moving it."""
