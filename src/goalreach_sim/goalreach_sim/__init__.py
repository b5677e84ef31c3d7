"""Simulated Nomad 200: robot, arena, sensors and camera.

Start with `Simulator`, which yields a `SensorFrame` per camera period. `Robot` is the mobile base
alone. `HostBase` drives a real or simulated robot through its `HostLanguage`.
"""

from goalreach_sim.camera_renderer import CameraRenderer
from goalreach_sim.camera_view import CameraPose, CameraView, OpticsConfig
from goalreach_sim.host_language import HostBase, HostLanguage, Nomad200
from goalreach_sim.robot import Robot, Walls
from goalreach_sim.sensors import SensorFrame
from goalreach_sim.simulator import Simulator
from goalreach_sim.simulator_config import (
    DriveConfig,
    HeadConfig,
    SimulatedFaults,
    SimulatorConfig,
    TimeConfig,
)

__all__ = [
    'CameraPose',
    'CameraRenderer',
    'CameraView',
    'DriveConfig',
    'HeadConfig',
    'HostBase',
    'HostLanguage',
    'Nomad200',
    'OpticsConfig',
    'Robot',
    'SensorFrame',
    'SimulatedFaults',
    'Simulator',
    'SimulatorConfig',
    'TimeConfig',
    'Walls',
]
