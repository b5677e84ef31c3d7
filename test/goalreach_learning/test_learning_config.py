import pytest

from goalreach_learning.q_learning import LearningConfig
from goalreach_msgs_py.errors import ConfigurationError


def test_temperature_falls_geometrically_from_start_to_end() -> None:
    config = LearningConfig(trials=3, temperature_start=1.0, temperature_end=0.01)
    assert [config.temperature(t) for t in range(3)] == pytest.approx([1.0, 0.1, 0.01])
    assert config.temperature(99) == pytest.approx(0.01)


def test_a_single_trial_keeps_the_first_temperature() -> None:
    assert LearningConfig(trials=1, temperature_start=0.7).temperature(0) == 0.7


def test_the_paper_has_twenty_trials() -> None:
    assert LearningConfig().trials == 20


@pytest.mark.parametrize(('field', 'value'), [('alpha', 1.5), ('gamma', 1.0), ('trials', 0)])
def test_refuses_values_out_of_range(field: str, value: float) -> None:
    with pytest.raises(ConfigurationError, match=field):
        LearningConfig(**{field: value})  # type: ignore[arg-type]
