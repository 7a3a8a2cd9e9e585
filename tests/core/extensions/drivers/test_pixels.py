"""Pixel formats: every value that was sent is in the image, at its full depth."""

import numpy as np
import pytest

from lightpen.arrays import IntArray
from lightpen.cameras.pixel_formats import PixelFormat, pixel_format_named
from lightpen_extensions.drivers.pixels import decoded, usable

RNG = np.random.default_rng(3)
WIDTH, HEIGHT = 7, 5  # neither fills a group of packed pixels


def known(name: str) -> PixelFormat:
    found = pixel_format_named(name)
    assert found is not None
    return found


def stream(values: IntArray, bits: int) -> bytes:
    """Put values one behind the other, the lowest bit first."""
    number = 0
    for i, value in enumerate(values.reshape(-1).tolist()):
        number |= value << (i * bits)
    return number.to_bytes(-(-values.size * bits // 8), "little")


def packed(values: IntArray, bits: int) -> bytes:
    """Put two values into three bytes, their low bits in the one between."""
    flat = [*values.reshape(-1).tolist(), 0]
    n_low = bits - 8
    mask = 2**n_low - 1
    found = bytearray()
    for one, other in zip(flat[::2], flat[1::2], strict=False):
        low = (one & mask) | (other & mask) << 4
        found += bytes([one >> n_low, low, other >> n_low])
    return bytes(found)


def image(bits: int) -> IntArray:
    values = RNG.integers(0, 2**bits, (HEIGHT, WIDTH))
    values[0, :2] = 0, 2**bits - 1
    return values


@pytest.mark.parametrize("bits", [8, 10, 12, 14, 16])
def test_whole_values_come_as_they_are(bits: int) -> None:
    values = image(bits)
    sent = values.astype(np.uint8 if bits == 8 else "<u2").tobytes()
    data = np.frombuffer(sent, np.uint8)
    found = decoded(data, WIDTH, HEIGHT, known(f"Mono{bits}"))

    assert found.dtype == (np.uint8 if bits == 8 else np.uint16)
    np.testing.assert_array_equal(found, values)
    assert np.shares_memory(found, data)  # no copy on the way to the spot finder


@pytest.mark.parametrize("bits", [10, 12])
@pytest.mark.parametrize(("ending", "pack"), [("p", stream), ("Packed", packed)])
def test_packed_values_are_unpacked(bits: int, ending: str, pack: object) -> None:
    values = image(bits)
    assert callable(pack)
    data = np.frombuffer(pack(values, bits), np.uint8)

    found = decoded(data, WIDTH, HEIGHT, known(f"Mono{bits}{ending}"))

    np.testing.assert_array_equal(found, values)


def test_what_pads_a_row_is_left_out() -> None:
    values = image(8)
    rows = np.pad(values, ((0, 0), (0, 3)), constant_values=99).astype(np.uint8)

    found = decoded(rows.reshape(-1), WIDTH, HEIGHT, known("Mono8"), padding=3)

    np.testing.assert_array_equal(found, values)


@pytest.mark.parametrize(
    ("pattern", "place"),
    [("RG", (0, 0)), ("BG", (1, 1)), ("GR", (0, 1)), ("GB", (1, 0))],
)
@pytest.mark.parametrize("bits", [8, 12])
def test_red_light_is_as_bright_in_every_bayer_pattern(
    pattern: str, place: tuple[int, int], bits: int
) -> None:
    level = 200 if bits == 8 else 3200
    values = np.zeros((8, 8), np.uint8 if bits == 8 else "<u2")
    values[place[0] :: 2, place[1] :: 2] = level
    found = decoded(
        np.frombuffer(values.tobytes(), np.uint8), 8, 8, known(f"Bayer{pattern}{bits}")
    )

    assert found.dtype == (np.uint8 if bits == 8 else np.uint16)
    assert found[2:6, 2:6] == pytest.approx(0.299 * level, abs=1)


@pytest.mark.parametrize(
    ("name", "pixel"),
    [
        ("RGB8", (10, 20, 30)),
        ("RGB8Packed", (10, 20, 30)),
        ("BGR8", (30, 20, 10)),
        ("RGBa8", (10, 20, 30, 255)),
        ("BGRA8Packed", (30, 20, 10, 255)),
    ],
)
def test_colours_become_their_luminance(name: str, pixel: tuple[int, ...]) -> None:
    data = np.tile(np.array(pixel, np.uint8), 12)

    found = decoded(data, 4, 3, known(name))

    assert found.shape == (3, 4)
    assert (found == round(0.299 * 10 + 0.587 * 20 + 0.114 * 30)).all()


@pytest.mark.parametrize(
    ("name", "pair"), [("YUV422_8", (77, 128)), ("YUV422_8_UYVY", (128, 77))]
)
def test_of_yuv_the_luminance_is_taken(name: str, pair: tuple[int, int]) -> None:
    found = decoded(np.tile(np.array(pair, np.uint8), 12), 4, 3, known(name))

    assert (found == 77).all()


def test_too_few_bytes_are_no_image() -> None:
    with pytest.raises(ValueError, match="35 bytes, got 34"):
        decoded(np.zeros(34, np.uint8), WIDTH, HEIGHT, known("Mono8"))


@pytest.mark.parametrize("name", ["", "Mono1p", "Mono14p", "Confidence8", "RGB12p"])
def test_what_cannot_be_decoded_is_not_offered(name: str) -> None:
    assert pixel_format_named(name) is None


def test_grey_is_offered_before_colour_and_whole_before_packed() -> None:
    offered = ("RGB8", "BayerRG8", "Mono12Packed", "JPEG", "Mono16", "Mono8")

    assert usable(offered) == (
        *("Mono8", "Mono16", "Mono12Packed", "RGB8", "BayerRG8"),
    )
    assert known("Mono12p").is_mono
    assert not known("BayerRG8").is_mono
    assert not known("YUV422_8").is_mono
