"""Reading, writing, comparing and repairing rosbag2 bags."""
