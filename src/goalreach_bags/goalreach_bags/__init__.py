"""Recording, reading, replaying, comparing, exporting and repairing of rosbag2 bags."""
