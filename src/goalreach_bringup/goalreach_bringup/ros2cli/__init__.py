"""The part of the `ros2` command line that this project needs where ROS is not installed."""
