"""The ROS nodes and node processes of the launcher."""
