"""Runs that can be kept: rosbag2 bags written, read, repaired, compared and replayed."""
