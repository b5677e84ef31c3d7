"""Command line, launcher and `ros2` commands."""
