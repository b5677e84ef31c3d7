"""Images to messages and back: every encoding, and images that cannot be used."""

from array import array
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
import pytest
from rclpy.serialization import serialize_message
from sensor_msgs.msg import CompressedImage, Image

from goalreach_msgs_py.cdr import MessageError
from goalreach_msgs_py.image_messages import (
    compressed_image_from_raw,
    compressed_image_to_raw,
    decoded_image_from_raw,
    image_from_raw,
    image_to_raw,
)
from ros_objects import as_object, by_others, changed

STAMP = 1_234_567_890_123
PIXELS = np.arange(12, dtype=np.uint8).reshape(3, 4)
IMAGE = image_to_raw(PIXELS, STAMP)
SCENE = np.random.default_rng(0).integers(0, 256, (6, 8), np.uint8)
COLOUR = np.random.default_rng(1).integers(0, 256, (6, 8, 4), np.uint8)
RED, GREEN, BLUE, _ = np.moveaxis(COLOUR.astype(float), 2, 0)
LUMA = 0.299 * RED + 0.587 * GREEN + 0.114 * BLUE  # ITU-R BT.601
CHROMA = np.random.default_rng(2).integers(0, 256, (6, 8), np.uint8)


def message(
    encoding: str, pixels: NDArray[Any], *, padding: int = 0, is_bigendian: int = 0
) -> bytes:
    """Return an image as a foreign driver sends it, with padded rows."""
    packed = np.ascontiguousarray(pixels).view(np.uint8).reshape(len(pixels), -1)
    rows = np.pad(packed, ((0, 0), (0, padding)), constant_values=77)
    image = Image(height=len(pixels), width=pixels.shape[1], encoding=encoding)
    image.is_bigendian = is_bigendian
    image.step, image.data = rows.shape[1], array('B', rows.tobytes())
    return bytes(serialize_message(image))


def test_image() -> None:
    image = as_object(IMAGE, Image)
    assert (image.width, image.height, image.step, image.encoding) == (4, 3, 4, 'mono8')
    assert image.header.frame_id == 'camera_optical_frame'
    for raw in by_others(IMAGE, Image):
        assert image_from_raw(raw).tolist() == PIXELS.tolist()


def test_image_of_every_second_column() -> None:
    assert (image_from_raw(image_to_raw(PIXELS[:, ::2], STAMP)) == PIXELS[:, ::2]).all()


def test_image_shares_the_memory_of_its_message() -> None:
    assert not image_from_raw(IMAGE).flags.owndata


@pytest.mark.parametrize('padding', [0, 4])
@pytest.mark.parametrize('encoding', ['mono8', '8UC1'])
def test_grey_images_are_taken_as_they_are(encoding: str, padding: int) -> None:
    assert (image_from_raw(message(encoding, SCENE, padding=padding)) == SCENE).all()


@pytest.mark.parametrize('padding', [0, 6])
@pytest.mark.parametrize(('order', 'is_bigendian'), [('<u2', 0), ('>u2', 1)])
@pytest.mark.parametrize('encoding', ['mono16', '16UC1'])
def test_deep_images_keep_their_highest_bits(
    encoding: str, order: str, is_bigendian: int, padding: int
) -> None:
    deep = (SCENE.astype(np.uint16) * 256 + 99).astype(order)
    raw = message(encoding, deep, padding=padding, is_bigendian=is_bigendian)
    assert (image_from_raw(raw) == SCENE).all()


def test_a_deep_image_of_twelve_bits_keeps_the_highest_of_these() -> None:
    raw = message('mono16', SCENE.astype('<u2') * 16 + 9)
    assert (image_from_raw(raw, bits=12) == SCENE).all()
    assert image_from_raw(message('mono16', np.full((2, 2), 4096, '<u2')), bits=12).max() == 255


@pytest.mark.parametrize('padding', [0, 8])
@pytest.mark.parametrize('kind', ['rgb', 'bgr', 'rgba', 'bgra'])
@pytest.mark.parametrize('bits', [8, 16])
def test_colours_become_their_luma(kind: str, bits: int, padding: int) -> None:
    pixels = COLOUR[..., ['rgba'.index(channel) for channel in kind]]
    if bits == 16:
        pixels = (pixels.astype('<u2') << 8).astype('<u2')
    grey = image_from_raw(message(f'{kind}{bits}', pixels, padding=padding))
    assert grey.shape == (6, 8)
    assert np.abs(grey - LUMA).max() <= 0.51


@pytest.mark.parametrize(
    ('encoding', 'first'), [('yuv422', 1), ('uyvy', 1), ('yuv422_yuy2', 0), ('yuyv', 0)]
)
def test_yuv_images_give_their_luma(encoding: str, first: int) -> None:
    pixels = np.stack([SCENE, CHROMA] if first == 0 else [CHROMA, SCENE], axis=2)
    assert (image_from_raw(message(encoding, pixels, padding=2)) == SCENE).all()


@pytest.mark.parametrize('pattern', ['rggb', 'bggr', 'gbrg', 'grbg'])
@pytest.mark.parametrize('bits', [8, 16])
def test_a_mosaic_gives_the_luma_of_an_even_colour(pattern: str, bits: int) -> None:
    colour = {'r': 200, 'g': 100, 'b': 40}
    mosaic = np.array([colour[letter] for letter in pattern], np.uint8).reshape(2, 2)
    pixels: NDArray[Any] = np.tile(mosaic, (4, 4))
    if bits == 16:
        pixels = (pixels.astype('<u2') << 8).astype('<u2')
    grey = image_from_raw(message(f'bayer_{pattern}{bits}', pixels))
    assert grey.shape == (8, 8)
    assert np.abs(grey[2:-2, 2:-2] - (0.299 * 200 + 0.587 * 100 + 0.114 * 40)).max() <= 1.0


@pytest.mark.parametrize(('width', 'height'), [(320, 240), (1920, 1080)])
@pytest.mark.parametrize('encoding', ['mono8', 'bgr8'])
def test_images_of_any_size(encoding: str, width: int, height: int) -> None:
    shape = (height, width, 3) if encoding == 'bgr8' else (height, width)
    pixels = np.full(shape, 10, np.uint8)
    pixels[height - 2, width - 3] = 250
    grey = image_from_raw(message(encoding, pixels))
    assert np.argwhere(grey > 200).tolist() == [[height - 2, width - 3]]


@pytest.mark.parametrize(
    'change',
    [
        {'encoding': 'rgb8'},
        {'encoding': '32FC1'},
        {'width': 5},
        {'height': 2},
        {'step': 3},
        {'width': 0},
    ],
)
def test_image_that_does_not_fit_is_refused(change: dict[str, Any]) -> None:
    with pytest.raises(MessageError, match=r'must be one of mono8, 8UC1|do not fit'):
        image_from_raw(changed(IMAGE, Image, **change))


def test_compressed_image() -> None:
    raw = compressed_image_to_raw(b'\xff\xd8jpeg', STAMP)
    image = as_object(raw, CompressedImage)
    assert (image.format, image.data) == ('jpeg', array('B', b'\xff\xd8jpeg'))
    for each in by_others(raw, CompressedImage):
        assert compressed_image_from_raw(each) == b'\xff\xd8jpeg'


@pytest.mark.parametrize(('suffix', 'tolerance'), [('.png', 1.01), ('.jpg', 25.0)])
def test_images_are_decompressed(suffix: str, tolerance: float) -> None:
    bgr = cv2.resize(COLOUR[..., 2::-1], (64, 48), interpolation=cv2.INTER_CUBIC)
    raw = compressed_image_to_raw(bytes(cv2.imencode(suffix, bgr)[1]), STAMP)
    expected = bgr.astype(float) @ (0.114, 0.587, 0.299)
    assert np.abs(decoded_image_from_raw(raw) - expected).max() <= tolerance


@pytest.mark.parametrize('encoded', [b'', b'\xff\xd8jpeg', bytes(100)])
def test_compressed_images_that_cannot_be_decoded_are_refused(encoded: bytes) -> None:
    with pytest.raises(MessageError, match=f'data of {len(encoded)} bytes'):
        decoded_image_from_raw(compressed_image_to_raw(encoded, STAMP))


@pytest.mark.parametrize(
    ('reader', 'raw'),
    [
        (image_from_raw, IMAGE),
        (compressed_image_from_raw, compressed_image_to_raw(bytes(20), STAMP)),
    ],
)
def test_what_is_cut_off_is_refused(reader: Callable[[bytes], object], raw: bytes) -> None:
    for size in range(0, len(raw) - 8, 7):
        with pytest.raises(MessageError):
            reader(raw[:size])
