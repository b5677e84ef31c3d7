"""A robot that learns to reach a goal it sees: the public face of the project."""
