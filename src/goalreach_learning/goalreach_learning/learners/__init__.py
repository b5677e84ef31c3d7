"""The project's learners, one module each; `goalreach_learning.learner` is what they fulfil."""
