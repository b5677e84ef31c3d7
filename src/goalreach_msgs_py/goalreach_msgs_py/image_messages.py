"""Images as serialized messages, and back: whatever the encoding, grey values come out."""

import itertools
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.cdr import CdrReader, CdrWriter, MessageError
from goalreach_msgs_py.topics import CAMERA_FRAME

_GREY: Final = 'mono8'
_DEEP_BITS: Final = 16
_COLOURS: Final = {
    'rgb': (3, cv2.COLOR_RGB2GRAY),
    'bgr': (3, cv2.COLOR_BGR2GRAY),
    'rgba': (4, cv2.COLOR_RGBA2GRAY),
    'bgra': (4, cv2.COLOR_BGRA2GRAY),
    'bayer_rggb': (1, cv2.COLOR_BayerRGGB2GRAY),
    'bayer_bggr': (1, cv2.COLOR_BayerBGGR2GRAY),
    'bayer_gbrg': (1, cv2.COLOR_BayerGBRG2GRAY),
    'bayer_grbg': (1, cv2.COLOR_BayerGRBG2GRAY),
}
_ENCODINGS: Final[dict[str, tuple[int, int, int | None]]] = {
    **dict.fromkeys((_GREY, '8UC1'), (1, 8, None)),
    **dict.fromkeys(('mono16', '16UC1'), (1, _DEEP_BITS, None)),
    **dict.fromkeys(('yuv422', 'uyvy'), (2, 8, cv2.COLOR_YUV2GRAY_UYVY)),
    **dict.fromkeys(('yuv422_yuy2', 'yuyv'), (2, 8, cv2.COLOR_YUV2GRAY_YUY2)),
    **{
        f'{name}{bits}': (channels, bits, conversion)
        for (name, (channels, conversion)), bits in itertools.product(_COLOURS.items(), (8, 16))
    },
}
"""Channels, bits of each, and OpenCV's conversion to grey, by encoding (image_encodings.hpp)."""


def image_to_raw(image: NDArray[np.uint8], stamp_ns: int, prefix: str = '') -> bytes:
    """Return a (height, width) grey image as sensor_msgs/Image mono8."""
    height, width = image.shape
    writer = CdrWriter(stamp_ns, prefix + CAMERA_FRAME)
    writer.numbers('2I', height, width)
    writer.text(_GREY)
    writer.zeros('B')
    writer.numbers('2I', width, height * width)
    return writer.raw(image.data if image.flags.c_contiguous else image.tobytes())


def image_from_raw(raw: bytes, *, bits: int = _DEEP_BITS) -> NDArray[np.uint8]:
    """Return a sensor_msgs/Image as grey values; mono8 shares its memory.

    Args:
        raw: The message.
        bits: How many of the 16 bits of a deep image are in use, from the lowest: 12 or 10 where
            the driver does not scale them. The highest 8 of them are kept.

    Returns:
        (height, width) grey values.

    Raises:
        MessageError: An unknown encoding, or sizes that do not fit the data.
    """
    reader = CdrReader(raw)
    height, width = reader.numbers('2I')
    encoding = reader.text()
    if encoding not in _ENCODINGS:
        raise MessageError(f'encoding = {encoding!r}: must be one of {", ".join(_ENCODINGS)}')
    channels, depth, conversion = _ENCODINGS[encoding]
    (is_big_endian,) = reader.numbers('B')
    (step,) = reader.numbers('I')
    data = reader.data()
    used = width * channels * depth // 8
    if step < used or height * step != len(data) or 0 in (height, width):
        size = f'{width} x {height} {encoding}, step {step}, {len(data)} bytes'
        raise MessageError(f'image of {size}: sizes do not fit one another')
    pixels = np.frombuffer(data, np.uint8).reshape(height, step)[:, :used]
    if depth == _DEEP_BITS:
        deep = np.ascontiguousarray(pixels).view('>u2' if is_big_endian else '<u2')
        pixels = np.minimum(deep >> (bits - 8), 255).astype(np.uint8)
    if conversion is None:
        return pixels
    shape = (height, width, channels) if channels > 1 else (height, width)
    grey = cv2.cvtColor(np.ascontiguousarray(pixels).reshape(shape), conversion)
    return np.asarray(grey, np.uint8)


def compressed_image_to_raw(encoded: bytes, stamp_ns: int, prefix: str = '') -> bytes:
    """Return a JPEG image as sensor_msgs/CompressedImage."""
    writer = CdrWriter(stamp_ns, prefix + CAMERA_FRAME)
    writer.text('jpeg')
    writer.numbers('I', len(encoded))
    return writer.raw(encoded)


def compressed_image_from_raw(raw: bytes) -> bytes:
    """Return the encoded image of a sensor_msgs/CompressedImage.

    Raises:
        MessageError: It cannot be read.
    """
    reader = CdrReader(raw)
    reader.skip_text()
    return bytes(reader.data())


def decoded_image_from_raw(raw: bytes) -> NDArray[np.uint8]:
    """Return the image of a sensor_msgs/CompressedImage as grey values; see `decode_image`."""
    return decode_image(compressed_image_from_raw(raw))


def decode_image(encoded: bytes) -> NDArray[np.uint8]:
    """Return an encoded image (JPEG, PNG, ...) as grey values.

    Raises:
        MessageError: OpenCV cannot decode it.
    """
    flags = cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION
    try:
        image = cv2.imdecode(np.frombuffer(encoded, np.uint8), flags)
    except cv2.error:  # empty, or larger than it admits
        image = None
    if image is None:
        raise MessageError(f'data of {len(encoded)} bytes: must be an image that OpenCV decodes')
    return np.asarray(image, np.uint8)
