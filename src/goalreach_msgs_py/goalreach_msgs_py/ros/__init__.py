"""Conversions to ROS messages, QoS, parameters and the life of a node."""
