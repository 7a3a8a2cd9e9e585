"""Every page of a TIFF is read as its sensor delivered it, whatever its layout."""

import struct
from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

import cv2
import numpy as np
import pytest

from lightpen.arrays import Image
from lightpen.errors import FileError
from lightpen.formats.decoding import decode_image
from lightpen.formats.images import find_images

RNG = np.random.default_rng(0)
GREY = RNG.integers(0, 255, (45, 67), dtype=np.uint8)
DEEP = RNG.integers(0, 65535, (45, 67), dtype=np.uint16)
COLOUR = RNG.integers(0, 65535, (45, 67, 3), dtype=np.uint16)  # red, green, blue


Page: TypeAlias = tuple[dict[int, Sequence[int]], Sequence[bytes]]


def tiff(
    *pages: Page, order: str = "<", is_big: bool = False, description: bytes = b""
) -> bytes:
    """Return a TIFF of pages, each of tags and strips (or planes) of pixels."""
    offset, n_inline = ("Q", 8) if is_big else ("I", 4)
    version = (
        struct.pack(order + "HHH", 43, 8, 0) if is_big else struct.pack(order + "H", 42)
    )
    data = bytearray((b"II" if order == "<" else b"MM") + version + bytes(n_inline))
    link = len(data) - n_inline

    def stored(content: bytes) -> int:
        place = len(data)
        data.extend(content)
        return place

    for tags, strips in pages:
        places = [stored(strip) for strip in strips]
        kinds = {tag: ("I", list(values)) for tag, values in tags.items()}
        kinds[273] = (offset, places)
        kinds[279] = (offset, list(map(len, strips)))
        entries = []
        for tag, (layout, values) in kinds.items():
            content = struct.pack(f"{order}{len(values)}{layout}", *values)
            if len(content) > n_inline:
                content = struct.pack(order + offset, stored(content))
            kind = 16 if layout == "Q" else 4
            head = struct.pack(f"{order}HH{offset}", tag, kind, len(values))
            entries.append((tag, head + content.ljust(n_inline, b"\0")))
        if description:
            head = struct.pack(f"{order}HH{offset}", 270, 2, len(description))
            text = struct.pack(order + offset, stored(description))
            entries.append((270, head + text))
        directory = stored(struct.pack(order + ("Q" if is_big else "H"), len(entries)))
        data.extend(b"".join(entry for _, entry in sorted(entries)))
        struct.pack_into(order + offset, data, link, directory)
        link = stored(bytes(n_inline))
    return bytes(data)


def page(image: Image, order: str = "<", **tags: int) -> Page:
    """Return tags and strips of a grey page; further tags by their numbers, as t274."""
    own: dict[int, Sequence[int]] = {
        256: [67],
        257: [45],
        258: [8 * image.itemsize],
        259: [1],
        262: [1],
        277: [1],
    }
    own |= {int(tag[1:]): [value] for tag, value in tags.items()}
    values = image.astype(f"{order}u{image.itemsize}").tobytes()
    return own, [values]


def images_of(data: bytes, folder: Path) -> tuple[tuple[str, ...], list[Image]]:
    (folder / "swing.tif").write_bytes(data)
    source = find_images(str(folder / "swing.tif"))
    return source.names, [load() for load in source.open()]


@pytest.mark.parametrize("is_big", [False, True])
@pytest.mark.parametrize("order", ["<", ">"])
def test_every_page_is_an_image(tmp_path: Path, order: str, is_big: bool) -> None:
    stack = [DEEP, DEEP[::-1], DEEP[:, ::-1]]
    data = tiff(*(page(each, order) for each in stack), order=order, is_big=is_big)

    names, images = images_of(data, tmp_path)

    assert names == ("swing page 1", "swing page 2", "swing page 3")
    for image, expected in zip(images, stack, strict=True):
        np.testing.assert_array_equal(image, expected)


@pytest.mark.parametrize("compression", [1, 5, 8, 32773])
def test_the_pages_of_opencv_are_read(tmp_path: Path, compression: int) -> None:
    stack = [DEEP, DEEP.T.copy()]
    options = [cv2.IMWRITE_TIFF_COMPRESSION, compression]
    _, data = cv2.imencodemulti(".tif", stack, options)

    _, images = images_of(bytes(data), tmp_path)

    for image, expected in zip(images, stack, strict=True):
        np.testing.assert_array_equal(image, expected)


def test_previews_and_masks_are_no_images(tmp_path: Path) -> None:
    data = tiff(page(GREY), page(GREY, t254=1), page(GREY, t254=4), page(GREY[::-1]))

    names, _ = images_of(data, tmp_path)

    assert len(names) == 2


@pytest.mark.parametrize(
    "description",
    [
        b"ImageJ=1.53t\nimages=3\nframes=3\n\0",
        b'{"shape": [3, 45, 67], "truncated": true}\0',
    ],
)
def test_pages_without_directory_are_read(tmp_path: Path, description: bytes) -> None:
    stack = np.stack([DEEP, DEEP[::-1], DEEP[:, ::-1]])
    tags, _ = page(DEEP)
    head = tiff((tags, [b""]), description=description)
    data = bytearray(tiff((tags, [DEEP.tobytes()]), description=description))
    assert len(head) < len(data)
    # The pixels of the first page are at byte 8; here all pages are at the end.
    place = len(data)
    at = data.index(struct.pack("<HHII", 273, 4, 1, 8))
    struct.pack_into("<I", data, at + 8, place)
    data += stack.tobytes()

    _, images = images_of(bytes(data), tmp_path)

    np.testing.assert_array_equal(images, stack)


def test_the_pages_of_metamorph_are_counted_by_its_own_tag(tmp_path: Path) -> None:
    stack = np.stack([DEEP, DEEP[::-1], DEEP[:, ::-1]])
    tags, _ = page(DEEP)
    data = bytearray(tiff((tags | {33629: [0] * 3}, [stack.tobytes()])))
    at = data.index(struct.pack("<HHI", 279, 4, 1))
    struct.pack_into("<I", data, at + 8, DEEP.nbytes)

    _, images = images_of(bytes(data), tmp_path)

    np.testing.assert_array_equal(images, stack)


def test_an_image_may_be_a_page_of_its_preview(tmp_path: Path) -> None:
    data = bytearray(tiff(page(GREY[::3, ::3], t254=1, t330=1), page(DEEP)))
    link = data.index(struct.pack("<HHI", 330, 4, 1)) + 8
    first = struct.unpack_from("<I", data, 4)[0]
    (count,) = struct.unpack_from("<H", data, first)
    following = first + 2 + 12 * count
    data[link : link + 4] = data[following : following + 4]
    data[following : following + 4] = bytes(4)

    names, images = images_of(bytes(data), tmp_path)

    assert names == ("swing.tif",)
    np.testing.assert_array_equal(images[0], DEEP)


def test_colours_of_video_that_are_not_subsampled_are_read() -> None:
    planes = np.stack([GREY, np.full_like(GREY, 128), np.full_like(GREY, 128)], axis=-1)
    tags, _ = page(GREY, t262=6)
    tags |= {258: [8, 8, 8], 277: [3], 530: [1, 1]}

    decoded = decode_image(tiff((tags, [planes.tobytes()])), "video")

    assert np.abs(decoded.astype(int) - GREY).max() <= 1


@pytest.mark.parametrize("image", [GREY, DEEP])
def test_white_may_be_zero(image: Image) -> None:
    decoded = decode_image(tiff(page(~image, t262=0)), "white")

    np.testing.assert_array_equal(decoded, image)


def test_colours_may_be_in_planes() -> None:
    tags: dict[int, Sequence[int]] = {
        256: [67],
        257: [45],
        258: [16] * 3,
        259: [1],
        262: [2],
        277: [3],
        284: [2],
    }
    planes = [COLOUR[..., i].tobytes() for i in range(3)]

    decoded = decode_image(tiff((tags, planes)), "planes")

    np.testing.assert_array_equal(decoded, cv2.cvtColor(COLOUR, cv2.COLOR_RGB2GRAY))


def test_values_with_exchanged_bytes_are_named() -> None:
    deep = np.right_shift(DEEP, 4, dtype=np.uint16)
    assert np.array_equal(decode_image(tiff(page(deep)), "a.tif"), deep)
    with pytest.raises(FileError, match="bytes of each value"):
        decode_image(tiff(page(deep.byteswap())), "a.tif")


def test_packed_values_of_12_bits_keep_their_scale() -> None:
    values = (DEEP >> 4)[:, :66]
    first, second = values[:, ::2].astype(np.uint32), values[:, 1::2].astype(np.uint32)
    triples = np.stack(
        [first >> 4, (first & 15) << 4 | second >> 8, second & 255], axis=-1
    ).astype(np.uint8)
    tags: dict[int, Sequence[int]] = {
        256: [66],
        257: [45],
        258: [12],
        259: [1],
        262: [1],
        277: [1],
    }

    decoded = decode_image(tiff((tags, [triples.tobytes()])), "packed")

    np.testing.assert_array_equal(decoded, values)


@pytest.mark.parametrize(
    ("tags", "words"),
    [
        ({"t259": 7}, "the compression JPEG"),
        ({"t259": 50000}, "the compression ZSTD"),
        ({"t259": 4711}, "the compression 4711"),
        ({"t262": 32803}, "raw image of a colour camera"),
        ({"t277": 5}, "5 channels"),
        ({"t258": 65}, "damaged"),
        ({"t256": 60_000, "t257": 60_000}, "60000 x 60000 px"),
    ],
)
def test_what_is_not_read_is_named(tags: dict[str, int], words: str) -> None:
    with pytest.raises(FileError, match=words):
        decode_image(tiff(page(GREY, "<", **tags)), "image")


def test_directories_that_lead_back_are_damaged(tmp_path: Path) -> None:
    data = bytearray(tiff(page(GREY)))
    data[-4:] = data[4:8]  # the next directory is the first

    with pytest.raises(FileError, match="damaged"):
        images_of(bytes(data), tmp_path)[1]


def test_a_cut_off_page_is_named(tmp_path: Path) -> None:
    data = tiff(page(GREY), page(GREY))
    tags, _ = page(GREY)
    (tmp_path / "cut.tif").write_bytes(tiff((tags, [GREY.tobytes()[:100]])))
    assert images_of(data, tmp_path)[1]

    with pytest.raises(FileError, match=r"cut\.tif"):
        next(iter(find_images(str(tmp_path / "cut.tif")).open()))()


def test_integers_of_32_bits_are_named(tmp_path: Path) -> None:
    tags, _ = page(GREY)
    data = tiff(({**tags, 258: [32]}, [GREY.astype(np.uint32).tobytes()]))

    with pytest.raises(FileError, match="uint32"):
        images_of(data, tmp_path)
