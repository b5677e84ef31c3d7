"""Noise presets."""

from dataclasses import fields

import pytest

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.noise import NoiseModel, noise_preset


def test_none_is_perfect_but_for_the_lens() -> None:
    perfect = noise_preset('none')
    errors = {f.name: getattr(perfect, f.name) for f in fields(perfect)}
    assert errors.pop('spot_sigma_px') == 1.2
    assert set(errors.values()) == {0.0}


def test_harsh_doubles_nominal() -> None:
    nominal, harsh = noise_preset('nominal'), noise_preset('harsh')
    assert nominal == NoiseModel()
    for name in ('read_noise_dn', 'focal_error', 'dropout_probability', 'survey_error_m'):
        assert getattr(harsh, name) == 2 * getattr(nominal, name)


def test_unknown_preset_is_refused() -> None:
    with pytest.raises(ConfigurationError, match='one of none, nominal, harsh'):
        noise_preset('loud')
