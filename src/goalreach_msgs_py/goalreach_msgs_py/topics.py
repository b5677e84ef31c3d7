"""Names of topics, services, frames, joints and nodes, in the default namespace.

Nodes create topics by `relative_name`, so that they follow the node into a namespace.
"""

from typing import Final

CLOCK: Final = '/clock'
IMAGE: Final = '/camera/image_raw'
COMPRESSED_IMAGE: Final = f'{IMAGE}/compressed'
CAMERA_INFO: Final = '/camera/camera_info'
ODOM: Final = '/odom'
JOINT_STATES: Final = '/joint_states'
BUMPERS: Final = '/bumpers'
SONAR: Final = '/sonar'
SENSORS: Final = (ODOM, JOINT_STATES, BUMPERS, CAMERA_INFO, IMAGE)
"""What the robot measures, the image last, as it sends it."""
GROUND_TRUTH: Final = '/ground_truth/odom'
MARKERS: Final = '/arena/markers'
POSE: Final = '/pose'
LANDMARKS: Final = '/landmarks'
LANDMARK_MARKERS: Final = '/landmarks/markers'
HEAD_COMMAND: Final = '/head/command'
STATE: Final = '/state'
CMD_VEL: Final = '/cmd_vel'
DISCONNECTED_CMD_VEL: Final = '/cmd_vel_not_sent'
"""Commands of a controller that is disconnected from the robot."""
BEHAVIORS: Final = '/behaviors'
BEHAVIOR_MARKERS: Final = '/behaviors/markers'
TRANSITION: Final = '/q_learning/transition'
Q_TABLE: Final = '/q_learning/q_table'
MODEL: Final = '/q_learning/model'
PATH: Final = '/path'
DIAGNOSTICS: Final = '/diagnostics'

RESET_SERVICE: Final = '/nomad200/reset'
PAUSE_SERVICE: Final = '/nomad200/pause'
STEP_SERVICE: Final = '/nomad200/step'

MAP_FRAME: Final = 'map'
ODOM_FRAME: Final = 'odom'
BASE_FRAME: Final = 'base_link'
BUMPER_FRAME: Final = 'bumper_link'
CAMERA_FRAME: Final = 'camera_optical_frame'
HEAD_JOINTS: Final = ('turret_joint', 'pan_joint', 'tilt_joint')
HEAD_KINDS: Final[dict[str, tuple[str, ...]]] = {
    'turret_pan_tilt': HEAD_JOINTS,
    'pan_tilt': HEAD_JOINTS[1:],
    'pan': HEAD_JOINTS[1:2],
    'none': (),
}
"""Joints by the kind of a head."""


def relative_name(name: str) -> str:
    """Return a topic relative to the namespace of its node; the clock is global."""
    return name if name == CLOCK else name.removeprefix('/')


def acknowledgement_topic(consumer: str) -> str:
    """Return the relative name under which a node acknowledges the ticks it has handled."""
    return f'_acknowledged/{consumer}'


ROBOT: Final = 'nomad200'
LOCALIZER: Final = 'landmark_localizer'
ESTIMATOR: Final = 'state_estimator'
CONTROLLER: Final = 'goal_reaching_controller'
NODES: Final = (ROBOT, LOCALIZER, ESTIMATOR, CONTROLLER)
MONITOR: Final = 'run_monitor'
RECORDER: Final = 'recorder'
