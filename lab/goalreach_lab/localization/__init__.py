"""Studies of the localizer: accuracy, consistency, kidnapping, long runs, speed."""
