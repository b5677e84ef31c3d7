"""Verbs of the `ros2` commands that need a node.

They raise `CommandError` where a name is not there, a value does not fit or nothing answers.
"""
