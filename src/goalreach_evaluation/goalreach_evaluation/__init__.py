"""The whole loop in one process without ROS, path metrics, figures and sweeps."""
