"""Services, waits and messages of the `goal_reaching_controller` node."""
