"""Sensor noise and errors: drawn by the simulator, assumed by the localizer.

The values of `nominal` are chosen, since the paper gives none: those of a careful laboratory
set-up of this kind. `harsh` doubles them, `none` has no errors at all.
"""

from dataclasses import dataclass, fields
from typing import Final

from goalreach_msgs_py.angles import INCH_M, deg
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.parameters import Configuration, parameter


@dataclass(frozen=True, kw_only=True)
class NoiseModel(Configuration):
    """Standard deviations: of one draw per run (error, bias) or one per sample (noise)."""

    read_noise_dn: float = parameter(
        1.5, 'Camera read noise per pixel, grey values (1 sigma)', within=(0.0, 50.0)
    )
    spot_sigma_px: float = parameter(
        1.2, "Width of the lens's point-spread function, pixels", within=(0.3, 20.0)
    )
    pan_tilt_noise_rad: float = parameter(
        deg(0.05), 'Pan and tilt encoder noise per reading, rad (1 sigma)', within=(0.0, 0.2)
    )
    pan_tilt_bias_rad: float = parameter(
        deg(0.15), 'Pan and tilt mounting error, drawn once, rad (1 sigma)', within=(0.0, 0.2)
    )
    survey_error_m: float = parameter(
        0.1 * INCH_M, 'Error of each LED coordinate, drawn once, m (1 sigma)', within=(0.0, 1.0)
    )
    camera_height_error_m: float = parameter(
        0.25 * INCH_M, 'Error of the camera height, drawn once, m (1 sigma)', within=(0.0, 1.0)
    )
    focal_error: float = parameter(
        0.003, 'Relative error of the focal length, drawn once (1 sigma)', within=(0.0, 0.2)
    )
    odometry_scale_error: float = parameter(
        0.01, 'Relative error of the distance driven, drawn once (1 sigma)', within=(0.0, 0.5)
    )
    odometry_drift_rad_per_m: float = parameter(
        deg(0.03) / INCH_M,
        'Slow turn of the base while driving, unseen by encoders, drawn once, rad/m (1 sigma)',
        within=(0.0, 1.0),
    )
    dropout_probability: float = parameter(
        0.03, 'Chance that an LED is dark in one image', within=(0.0, 1.0)
    )
    spurious_probability: float = parameter(
        0.03, 'Chance of one spurious light in one image', within=(0.0, 1.0)
    )

    def scaled(self, factor: float) -> 'NoiseModel':
        """Return the model with every error times `factor`; the lens keeps its spot width."""
        values = {f.name: getattr(self, f.name) * factor for f in fields(self)}
        return NoiseModel(**{**values, 'spot_sigma_px': self.spot_sigma_px})


_FACTORS: Final = {'none': 0.0, 'nominal': 1.0, 'harsh': 2.0}
NOISE_PRESETS: Final = tuple(_FACTORS)


def noise_preset(name: str) -> NoiseModel:
    """Return a preset.

    Args:
        name: `none`, `nominal` or `harsh`.

    Raises:
        ConfigurationError: There is no such preset.
    """
    if name not in _FACTORS:
        raise ConfigurationError('noise', name, 'one of ' + ', '.join(NOISE_PRESETS))
    return NoiseModel().scaled(_FACTORS[name])
