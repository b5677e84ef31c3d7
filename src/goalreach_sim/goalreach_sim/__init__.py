"""Simulated Nomad 200: robot, arena, sensors and camera.

Start with `simulator.Simulator`, which yields a `SensorFrame` per camera period. `robot.Robot` is
the mobile base alone.
"""
