"""Checks of an external robot: its messages, services and motions."""
