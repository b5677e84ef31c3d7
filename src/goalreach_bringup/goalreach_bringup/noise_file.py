"""Noise models in YAML: any of `NoiseModel`'s fields by name, the rest as in `nominal`."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import yaml

from goalreach_msgs_py.errors import ConfigurationError, FileFormatError, one_line_repr
from goalreach_msgs_py.noise import NOISE_PRESETS, NoiseModel, noise_preset
from goalreach_msgs_py.parameters import build_config
from goalreach_msgs_py.yaml_text import load_yaml

__all__ = ['choose_noise', 'read_noise']


def choose_noise(name: str) -> NoiseModel:
    """Return the preset of that name, or else the noise model of that file.

    Raises:
        FileFormatError: It is neither.
    """
    return noise_preset(name) if name in NOISE_PRESETS else read_noise(name)


def read_noise(path: str | Path) -> NoiseModel:
    """Return the noise model of a file.

    Raises:
        FileFormatError: The file cannot be read, names an unknown field or holds a bad value.
    """
    try:
        content = load_yaml(Path(path).read_text(encoding='utf-8'))
    except OSError as error:
        presets = ', '.join(NOISE_PRESETS)
        reason = f'is no preset ({presets}) and cannot be read: {error.strerror}'
        raise FileFormatError(path, reason) from None
    except (yaml.YAMLError, UnicodeDecodeError):
        raise FileFormatError(path, 'is not YAML') from None
    if not isinstance(content, dict):
        raise FileFormatError(path, 'must be a mapping of noise fields to numbers')
    known = {field.name for field in fields(NoiseModel)}
    for name, value in content.items():
        if name not in known:
            raise FileFormatError(
                path, f'{name} = {one_line_repr(value)}: no such field of a noise model'
            )
    try:
        return build_config(NoiseModel, content)
    except ConfigurationError as error:
        raise FileFormatError(path, str(error)) from None
