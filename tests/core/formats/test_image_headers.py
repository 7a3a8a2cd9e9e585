"""What an image is, and what decoding it takes, is known from its header."""

import struct
from io import BytesIO
from typing import Any

import cv2
import numpy as np
import pytest

from lightpen.errors import FileError
from lightpen.formats.image_headers import ImageHeader, read_image_header
from lightpen.formats.tiff_pages import is_tiff, read_page

RNG = np.random.default_rng(0)
WIDTH, HEIGHT = 67, 45


def image_of(depth: type, channels: int = 1) -> Any:
    return RNG.integers(0, 255, (HEIGHT, WIDTH, channels)).astype(depth)


def encoded(suffix: str, image: Any, *options: int) -> bytes:
    return bytes(cv2.imencode(suffix, image, options)[1])


def header_of(data: bytes) -> ImageHeader:
    if is_tiff(data):
        return read_page(BytesIO(data), "image", None).header
    return read_image_header(BytesIO(data), "image")


GREY, DEEP, COLOUR = image_of(np.uint8), image_of(np.uint16), image_of(np.uint8, 3)
FILES = {
    "png": encoded(".png", GREY),
    "png of 16 bits": encoded(".png", DEEP),
    "png in colour": encoded(".png", COLOUR),
    "png with transparency": encoded(".png", image_of(np.uint16, 4)),
    "jpeg": encoded(".jpg", GREY),
    "jpeg in colour": encoded(".jpg", COLOUR),
    "progressive jpeg": encoded(".jpg", COLOUR, cv2.IMWRITE_JPEG_PROGRESSIVE, 1),
    "bmp": encoded(".bmp", GREY),
    "bmp in colour": encoded(".bmp", COLOUR),
    "tiff": encoded(".tiff", GREY, cv2.IMWRITE_TIFF_COMPRESSION, 1),
    "tiff of 16 bits": encoded(".tiff", DEEP, cv2.IMWRITE_TIFF_COMPRESSION, 5),
    "tiff in colour": encoded(".tiff", COLOUR, cv2.IMWRITE_TIFF_COMPRESSION, 8),
    "pgm": encoded(".pgm", GREY),
    "pgm of 16 bits": encoded(".pgm", DEEP),
    "pgm as text": encoded(".pgm", GREY, cv2.IMWRITE_PXM_BINARY, 0),
    "pgm with a remark": b"P5 # 1 2\n67\n#\n45 255\n" + GREY.tobytes(),
    "webp": encoded(".webp", COLOUR, cv2.IMWRITE_WEBP_QUALITY, 50),
    "webp without loss": encoded(".webp", COLOUR, cv2.IMWRITE_WEBP_QUALITY, 101),
}


@pytest.mark.parametrize("name", FILES)
def test_the_size_is_that_of_the_image(name: str) -> None:
    header = header_of(FILES[name])
    image = cv2.imdecode(np.frombuffer(FILES[name], np.uint8), cv2.IMREAD_UNCHANGED)

    assert (header.width, header.height) == (WIDTH, HEIGHT)
    assert image is not None
    assert header.decoded >= image.nbytes


@pytest.mark.parametrize("name", FILES)
def test_a_header_that_ends_early_is_damaged(name: str) -> None:
    for length in (1, 5, 8):
        with pytest.raises(FileError, match=r"cut off|damaged"):
            header_of(FILES[name][:length])


def test_a_format_whose_size_is_not_known_here_is_refused() -> None:
    with pytest.raises(FileError, match="Save the images as PNG or TIFF, or copy it"):
        header_of(b"not an image at all")


@pytest.mark.parametrize(
    ("data", "kind"),
    [
        (b"\0\0\0\x1cftypavif" + bytes(100), "AVIF"),
        (b"\0\0\0\x18ftypmif1" + bytes(100), "HEIC"),
        (b"\0\0\0\x1cftypisom" + bytes(100), "video"),
        (b"\xd4\xc3\xb2\xa1\2\0\4\0" + bytes(100), "network capture"),
        (b"GIF89a" + bytes(100), "GIF"),
        (b"v/1\x01" + bytes(100), "OpenEXR"),
        (b"SIMPLE  =                    T" + bytes(100), "FITS"),
        (bytes(128) + b"DICM" + bytes(100), "DICOM"),
        (b"LUCAM-RECORDER" + bytes(200), "SER"),
        (b"\0\0\0\x0cjP  \r\n\x87\n" + bytes(100), "JPEG 2000"),
        (b"\xff\x4f\xff\x51" + bytes(100), "JPEG 2000"),
        (b"\xff\x0a" + bytes(100), "JPEG XL"),
        (b"#?RADIANCE\n" + bytes(100), "HDR"),
        (b"Pf\n4 4\n-1.0\n" + bytes(64), "PFM"),
        (b"P7\nWIDTH 4\n" + bytes(64), "PAM"),
        (b"\x1a\x45\xdf\xa3" + bytes(100), "video"),
        (b"SDPX" + bytes(100), "DPX"),
        (bytes(257) + b"ustar" + bytes(100), "archive"),
    ],
)
def test_a_file_of_images_of_another_kind_is_named(data: bytes, kind: str) -> None:
    with pytest.raises(FileError, match=f"of the kind {kind}.*Save its images as"):
        header_of(data)


def test_several_images_in_one_pgm_are_not_taken_for_one() -> None:
    one = b"P5\n4 3\n255\n" + bytes(12)
    assert header_of(one).width == 4
    with pytest.raises(FileError, match="Save its images one by one"):
        header_of(one + one)


def test_a_png_with_a_header_of_two_bytes_is_damaged() -> None:
    data = b"\x89PNG\r\n\x1a\n" + struct.pack(">I4s", 2, b"IHDR") + bytes(50)

    with pytest.raises(FileError, match="damaged"):
        header_of(data)


def test_more_pixels_than_those_of_cameras_are_refused() -> None:
    pgm = b"P5\n60000 60000\n255\n"

    with pytest.raises(FileError, match=r"60000 x 60000 px; the maximum is 70,000,000"):
        header_of(pgm)


def test_a_tile_counts_by_its_own_size() -> None:
    entries = [(256, 100), (257, 100), (258, 8), (322, 16_000), (323, 16_000)]
    packed = b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in entries)
    data = b"II*\0" + struct.pack("<IH", 8, len(entries)) + packed + bytes(4)

    assert header_of(data).working >= 16_000 * 16_000


@pytest.mark.parametrize("kind", [6, 8, 9, 11, 12])
def test_a_size_that_the_decoder_reads_and_is_not_known_here_is_refused(
    kind: int,
) -> None:
    entries = [(256, kind, 60_000), (256, 3, 100), (257, 3, 100), (258, 3, 8)]
    packed = b"".join(
        struct.pack("<HHII", tag, k, 1, value) for tag, k, value in entries
    )

    with pytest.raises(FileError, match="damaged"):
        header_of(b"II*\0" + struct.pack("<IH", 8, len(entries)) + packed + bytes(4))


def jpeg_head(kind: int, n_channels: int, n_scanned: int) -> bytes:
    """Return a JPEG of 6000 x 4000 px up to its first scan."""
    channels = b"".join(bytes([i + 1, 0x11, 0]) for i in range(n_channels))
    frame = struct.pack(">BHHB", 8, 4000, 6000, n_channels) + channels
    scanned = b"".join(bytes([i + 1, 0]) for i in range(n_scanned))
    scan = bytes([n_scanned]) + scanned + b"\0\x3f\0"
    parts = [b"\xff\xd8"]
    for marker, body in ((kind, frame), (0xDA, scan)):
        parts.append(struct.pack(">BBH", 0xFF, marker, len(body) + 2) + body)
    return b"".join(parts)


@pytest.mark.parametrize(
    ("kind", "n_channels", "n_scanned", "bytes_a_pixel"),
    [
        (0xC0, 1, 1, 0),
        (0xC0, 3, 3, 0),
        (0xC0, 3, 1, 6),  # one channel after the other
        (0xC1, 4, 3, 8),
        (0xC2, 1, 1, 2),
        (0xCA, 3, 3, 6),  # progressive, with arithmetic coding
    ],
)
def test_a_jpeg_in_several_scans_takes_its_coefficients_besides(
    kind: int, n_channels: int, n_scanned: int, bytes_a_pixel: int
) -> None:
    header = header_of(jpeg_head(kind, n_channels, n_scanned))

    assert header.working == bytes_a_pixel * 6000 * 4000


@pytest.mark.parametrize(("kind", "depth"), [(0xC1, 12), (0xC3, 16), (0xF7, 16)])
def test_a_jpeg_of_more_than_8_bits_is_named(kind: int, depth: int) -> None:
    data = bytearray(jpeg_head(kind, 1, 1))
    data[6] = depth

    with pytest.raises(FileError, match="kind lossless or 12-bit JPEG"):
        header_of(bytes(data))


def test_a_jpeg_of_two_frames_is_refused() -> None:
    one = jpeg_head(0xC0, 1, 1)
    frame = one[2:15]

    with pytest.raises(FileError, match="damaged"):
        header_of(one[:15] + frame + one[15:])


def test_a_webp_animation_is_refused() -> None:
    head = b"VP8X" + struct.pack("<I", 10) + b"\x02\0\0\0" + bytes(6)

    with pytest.raises(FileError, match="animation"):
        header_of(b"RIFF" + struct.pack("<I", 4 + len(head)) + b"WEBP" + head)
