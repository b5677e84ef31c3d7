"""Values, camera model, regions, arena, parameters and topics, and the messages that carry them.

Everything here works without ROS; what needs rclpy is in `goalreach_msgs_py.ros`. Conversions
between values and serialized messages are in `pose_messages`, `image_messages`,
`sensor_messages` and `diagnostic_messages`, names in `topics`.
"""
