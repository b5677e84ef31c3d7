"""What learners need until their policy leads to the goal from every start."""
