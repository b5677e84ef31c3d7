"""Sensor noise and errors: drawn by the simulator, assumed by the localizer.

The values of `nominal` are chosen, since the paper gives none: those of a careful laboratory
set-up of this kind. `harsh` doubles them, `none` has no errors at all. `abroad` adds those of
other people's rooms and robots: light, exposure, a misplaced lens, slip, clocks of their own.
"""

from dataclasses import dataclass
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

    sonar_error: float = parameter(
        0.01, 'Relative error of a range of the sonar (1 sigma)', within=(0.0, 1.0)
    )
    sonar_dropout_probability: float = parameter(
        0.02, 'Chance that a sonar misses its echo', within=(0.0, 1.0)
    )
    ambient_dn: float = parameter(0.0, 'Grey value of lit walls', within=(0.0, 255.0))
    texture: float = parameter(
        0.0, 'Largest relative change of the walls at each of four sizes', within=(0.0, 1.0)
    )
    exposure_s: float = parameter(
        0.0, 'Time over which an image is exposed; its stamp is the middle, s', within=(0.0, 0.1)
    )
    lens_offset_m: float = parameter(
        0.0, 'Distance of the lens in front of the vertical axis, m', within=(-1.0, 1.0)
    )
    level_error_rad: float = parameter(
        0.0, 'Lean of the base, to front and side, drawn once, rad (1 sigma)', within=(0.0, 0.2)
    )
    side_slip_s: float = parameter(
        0.0,
        'Sideways slip of the tyres in a bend over its acceleration, s (soft tyres in '
        'examples/mujoco_world: 0.0125)',
        within=(0.0, 0.2),
    )
    sample_rate_hz: float = parameter(
        0.0,
        'Rate of odometry and joint readings on a clock of their own, with a jitter of a quarter '
        'of its period; images come two periods late. Topics hold what lies between, at stamps of '
        'images. 0: read at these stamps',
        within=(0.0, 1000.0),
    )
    image_delay_s: float = parameter(
        0.0,
        'How much later than the exposure the stamps of the images are, where sample_rate_hz is '
        'set, s; over topics, which are alike in stamps, tell camera_delay_s to the localizer',
        within=(0.0, 0.5),
    )

    def scaled(self, factor: float) -> 'NoiseModel':
        """Return the model with every error times `factor`; lens and rates stay."""
        values = {name: value * factor for name, value in vars(self).items()}
        same = {'spot_sigma_px': self.spot_sigma_px, 'sample_rate_hz': self.sample_rate_hz}
        return NoiseModel(**{**values, **same})


_PRESETS: Final = {
    'none': NoiseModel().scaled(0.0),
    'nominal': NoiseModel(),
    'harsh': NoiseModel().scaled(2.0),
    # Chosen: a lit office, a webcam, a mount by hand, rubber tyres, a driver of its own.
    'abroad': NoiseModel(
        ambient_dn=30.0,
        texture=0.1,
        exposure_s=0.008,
        lens_offset_m=0.005,
        level_error_rad=0.0015,
        side_slip_s=0.005,
        sample_rate_hz=100.0,
    ),
}
NOISE_PRESETS: Final = tuple(_PRESETS)


def noise_preset(name: str) -> NoiseModel:
    """Return one of `NOISE_PRESETS`.

    Raises:
        ConfigurationError: There is no such preset.
    """
    if name not in _PRESETS:
        raise ConfigurationError('noise', name, 'one of ' + ', '.join(NOISE_PRESETS))
    return _PRESETS[name]


def noise_parameters(preset: str) -> dict[str, float]:
    """Return the parameters of a node that expects or draws the noise of a preset."""
    return {f'noise.{name}': value for name, value in vars(noise_preset(preset)).items()}
