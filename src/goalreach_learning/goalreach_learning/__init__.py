"""The learner: Q-table, exploration, actions as options, policies and training."""
