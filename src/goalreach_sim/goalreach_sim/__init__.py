"""Simulated Nomad 200: robot, arena, sensors and camera.

Start with `Simulator`, which yields a `SensorFrame` per camera period. `Robot` is the mobile base
alone.
"""

from typing import TYPE_CHECKING

from goalreach_msgs_py.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from goalreach_sim.camera_renderer import CameraRenderer as CameraRenderer
    from goalreach_sim.camera_view import CameraPose as CameraPose
    from goalreach_sim.camera_view import CameraView as CameraView
    from goalreach_sim.camera_view import OpticsConfig as OpticsConfig
    from goalreach_sim.robot import Robot as Robot
    from goalreach_sim.robot import Walls as Walls
    from goalreach_sim.sensors import SensorFrame as SensorFrame
    from goalreach_sim.simulator import Simulator as Simulator
    from goalreach_sim.simulator_config import DriveConfig as DriveConfig
    from goalreach_sim.simulator_config import HeadConfig as HeadConfig
    from goalreach_sim.simulator_config import SimulatedFaults as SimulatedFaults
    from goalreach_sim.simulator_config import SimulatorConfig as SimulatorConfig
    from goalreach_sim.simulator_config import TimeConfig as TimeConfig

__all__, __getattr__, __dir__ = lazy_exports(__name__)
