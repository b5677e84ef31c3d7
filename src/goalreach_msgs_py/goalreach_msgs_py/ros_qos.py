"""Quality-of-service profiles of the graph."""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

__all__ = ['DEEP_QOS', 'LATCHED_QOS', 'NEWEST_QOS', 'RELIABLE_QOS', 'SENSOR_QOS']

SENSOR_QOS = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
"""ROS 2's sensor data profile: an old image is worth nothing (REP-2003)."""

NEWEST_QOS = QoSProfile(depth=2, reliability=ReliabilityPolicy.BEST_EFFORT)
"""For who reads images. After a pause only the newest counts, and DDS keeps the buffer of a whole
image for each place of the queue that was ever full. With one place a hundredth of the images is
lost in real time, with two hardly any."""

RELIABLE_QOS = QoSProfile(depth=10)
"""States, commands and events."""

DEEP_QOS = QoSProfile(depth=200)
"""What is judged and counted: a listener that is late by 200 ticks still misses none."""

LATCHED_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""What a late subscriber still needs: markers, Q-table."""
