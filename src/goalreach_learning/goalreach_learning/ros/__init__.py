"""Services and waits of the `goal_reaching_controller` node."""
