"""Where all meet: launcher, recording, replay, figures, evaluation and benchmarks."""
