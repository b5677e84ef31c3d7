"""Driving in a world that shares no code with the project: `examples/mujoco_world`."""
