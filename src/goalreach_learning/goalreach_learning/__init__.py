"""Q-learning, policies and the goal-reaching controller.

Start with `training.train`, which learns a `Policy` in an arena. The `GoalReachingController` of
`controller` drives it, with `blending.blend_heading` for fuzzy states. `gym_environment`, which
needs the extra `gym`, offers the same task to other learners.
"""
