"""Images from folders, patterns and videos; what is damaged is named."""

import os
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np
import pytest

from lightpen.arrays import FloatArray, Image
from lightpen.errors import FileError
from lightpen.formats.decoding import (
    decode_image,
    encode_png,
    full_scale_of,
    read_image,
)
from lightpen.formats.images import cameras_remark, find_images, is_mosaic, look_at_all
from lightpen.formats.video_process import (
    count_frames_in_process,
    frame_loaders_in_process,
)

RNG = np.random.default_rng(0)
GREY = RNG.integers(0, 255, (48, 64), dtype=np.uint8)


def png(image: Image) -> bytes:
    return bytes(cv2.imencode(".png", image)[1])


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder of three images, whose names sort otherwise as text."""
    folder = tmp_path / "Schwünge 摇摆"
    folder.mkdir()
    for name in ("frame_10.png", "frame_2.png", "frame_1.png"):
        (folder / name).write_bytes(png(GREY))
    (folder / "notes.txt").write_text("no image")
    (folder / "._frame_1.png").write_bytes(b"\0\5\x16\7")  # as macOS leaves behind
    (folder / ".frame_3.png").write_bytes(png(GREY))  # hidden
    (folder / "~$frame_4.png").write_bytes(b"open")
    return folder


def test_a_folder_gives_its_images_in_natural_order(folder: Path) -> None:
    source = find_images(str(folder))

    assert source.names == ("frame_1.png", "frame_2.png", "frame_10.png")
    for load in source.open():
        np.testing.assert_array_equal(load(), GREY)


def test_a_folder_without_images_has_them_in_its_subfolder_images(
    folder: Path, tmp_path: Path
) -> None:
    swing = tmp_path / "swing-1"
    swing.mkdir()
    folder.rename(swing / "images")

    assert len(find_images(str(swing)).names) == 3


def test_a_pattern_gives_the_matching_images(folder: Path) -> None:
    source = find_images(str(folder / "frame_1*.png"))

    assert source.names == ("frame_1.png", "frame_10.png")


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_images_are_stored_without_loss(kind: type[np.uint8]) -> None:
    rng = np.random.default_rng(1)
    image = rng.integers(0, np.iinfo(kind).max, (33, 47), dtype=kind)
    np.testing.assert_array_equal(decode_image(encode_png(image), "image"), image)


@pytest.mark.parametrize("channels", [3, 4])
def test_colour_becomes_grey(channels: int) -> None:
    colour = np.repeat(GREY[..., None], channels, axis=2)

    np.testing.assert_array_equal(decode_image(png(colour), "colour"), GREY)


def test_a_video_gives_its_frames(tmp_path: Path) -> None:
    path = tmp_path / "swing.avi"
    writer = cv2.VideoWriter(
        str(path), cv2.VideoWriter.fourcc(*"FFV1"), 20.0, (64, 48), isColor=False
    )
    frames = [np.roll(GREY, k, axis=1) for k in range(4)]
    for frame in frames:
        writer.write(frame)
    writer.release()

    source = find_images(str(path))

    assert source.names == ("frame 1", "frame 2", "frame 3", "frame 4")
    for load, frame in zip(source.open(), frames, strict=True):
        assert np.abs(load().astype(int) - frame).max() <= 1


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda data: data[: len(data) // 2], "cut off"),
        (lambda data: data[:-4], "cut off"),
        (lambda data: data[:100] + bytes([data[100] ^ 255]) + data[101:], "checksum"),
        (lambda data: data[:8], "cut off"),
        (lambda data: b"not an image at all", "not a supported image"),
    ],
)
def test_a_damaged_image_is_named(
    damage: Callable[[bytes], bytes], message: str
) -> None:
    with pytest.raises(FileError, match=message) as caught:
        decode_image(damage(png(GREY)), "frame_0007.png")

    assert "frame_0007.png" in str(caught.value)


def test_an_image_that_takes_too_much_memory_is_refused() -> None:
    deep = b"\x89PNG\r\n\x1a\n" + (13).to_bytes(4, "big") + b"IHDR"
    deep += (6000).to_bytes(4, "big") * 2 + bytes([16, 6, 0, 0, 0])

    with pytest.raises(
        FileError, match="needs 576 MB for decoding; the maximum is 250 MB"
    ):
        decode_image(deep, "deep.png")


def test_a_jpeg_without_end_is_refused() -> None:
    whole = bytes(cv2.imencode(".jpg", GREY)[1])

    assert decode_image(whole, "whole.jpg").shape == GREY.shape
    with pytest.raises(FileError, match="cut off"):
        decode_image(whole[:-500], "cut.jpg")


def test_a_jpeg_of_endless_scans_is_refused() -> None:
    whole = bytes(cv2.imencode(".jpg", GREY)[1])
    scan = whole.index(b"\xff\xda")

    with pytest.raises(FileError, match="JPEG of 101 scans; at most 64"):
        decode_image(whole[:scan] + 101 * whole[scan:-2] + whole[-2:], "long.jpg")


def png_chunk(kind: bytes, body: bytes) -> bytes:
    checksum = zlib.crc32(kind + body).to_bytes(4, "big")
    return len(body).to_bytes(4, "big") + kind + body + checksum


def test_an_animation_is_refused() -> None:
    still = png(GREY)
    control = png_chunk(b"acTL", bytes(8))

    with pytest.raises(FileError, match="animation"):
        decode_image(still[:33] + control + still[33:], "moving.png")


def test_a_png_that_goes_on_behind_its_image_is_refused() -> None:
    whole = png(GREY)
    more = png_chunk(b"IDAT", bytes(2**17))  # which zlib could unpack to 100 MB

    with pytest.raises(FileError, match="damaged"):
        decode_image(whole[:-12] + more + whole[-12:], "endless.png")


def test_a_png_of_countless_chunks_is_refused() -> None:
    whole = png(GREY)
    chunks = png_chunk(b"tEXt", b"") * 30_000

    with pytest.raises(FileError, match="damaged"):
        decode_image(whole[:33] + chunks + whole[33:], "pieces.png")


@pytest.mark.parametrize("level", [0, 9])
@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_a_png_of_noise_is_read_however_little_it_is_compressed(
    level: int, kind: type[np.uint8 | np.uint16]
) -> None:
    noise = RNG.integers(0, np.iinfo(kind).max, (300, 400), dtype=kind)
    data = bytes(cv2.imencode(".png", noise, [cv2.IMWRITE_PNG_COMPRESSION, level])[1])

    assert np.array_equal(decode_image(data, "noise.png"), noise)


def test_floating_point_images_are_refused() -> None:
    data = bytes(cv2.imencode(".tiff", GREY.astype(np.float32))[1])

    with pytest.raises(FileError, match="float32"):
        decode_image(data, "deep.tiff")


def test_nothing_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="Check the name"):
        find_images(str(tmp_path / "missing"))


TOLD = """
import sys
from lightpen.cameras.protocol import DeviceNotFound
from lightpen.cameras.replay import ReplayCamera
from lightpen.errors import FileError
from lightpen.formats.images import find_images
from lightpen.formats.video_process import (
    count_frames_in_process, frame_loaders_in_process
)
try:
    find_images(sys.argv[1])
except FileError as error:
    print(error)
try:
    ReplayCamera(sys.argv[1]).open()
except DeviceNotFound as error:
    print(error)
"""


@pytest.mark.parametrize("place", ["", "inner"])
def test_a_folder_that_may_not_be_looked_into_is_refused(
    folder: Path, obedient: Sequence[str], place: str
) -> None:
    folder.chmod(0)
    python = [sys.executable, "-X", "utf8", "-c", TOLD, str(folder / place)]
    reported = subprocess.run(
        [*obedient, *python], capture_output=True, encoding="utf-8", check=True
    )
    folder.chmod(0o700)

    sentence = (
        f"The source of images {folder / place} cannot be read: Permission denied. "
        "Check the read permission and the disk connection."
    )
    assert reported.stdout.splitlines() == [sentence, sentence]


def test_names_with_digits_that_are_no_numbers_have_an_order(tmp_path: Path) -> None:
    for name in ("5²3.png", "5.png", "٣.png", "10.png"):
        (tmp_path / name).write_bytes(png(GREY))

    names = find_images(str(tmp_path)).names

    assert names.index("5.png") < names.index("10.png")
    assert len(names) == 4


def write_video(
    path: Path, n_frames: int = 6, size: tuple[int, int] = (64, 48)
) -> None:
    frame = np.zeros((size[1], size[0], 3), dtype=np.uint8)
    code = cv2.VideoWriter.fourcc(*"MJPG")
    writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, code, 20.0, size)
    for _ in range(n_frames):
        writer.write(frame)
    writer.release()


def test_the_frames_of_a_video_are_counted_whatever_its_header_says(
    tmp_path: Path,
) -> None:
    path = tmp_path / "swing.avi"
    write_video(path)
    data = bytearray(path.read_bytes())
    of_file, of_stream = data.index(b"avih") + 24, data.index(b"strh") + 40
    for place in (of_file, of_stream):
        data[place : place + 4] = (2**31 - 2).to_bytes(4, "little")
    path.write_bytes(data)

    source = find_images(str(path))

    assert len(source.names) == 6
    assert [load().shape for load in source.open()] == [(48, 64)] * 6


def test_without_ffmpeg_motion_jpeg_is_read_and_other_videos_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cv2.videoio_registry, "hasBackend", lambda backend: False)
    good, other = tmp_path / "swing.avi", tmp_path / "other.avi"
    write_video(good)
    writer = cv2.VideoWriter(
        str(other), cv2.VideoWriter.fourcc(*"FFV1"), 20.0, (64, 48), isColor=False
    )
    writer.write(GREY)
    writer.release()

    n_frames, _ = count_frames_in_process(good)
    frames = [load().shape for load in frame_loaders_in_process(good, n_frames)]
    assert frames == [(48, 64)] * 6
    with pytest.raises(FileError, match="reads Motion JPEG in"):
        count_frames_in_process(other)


def test_a_video_of_larger_frames_than_those_of_cameras_is_refused(
    tmp_path: Path,
) -> None:
    small, large = (
        bytes(cv2.imencode(".jpg", np.zeros(shape, np.uint8))[1])
        for shape in ((48, 64, 3), (4100, 5000, 3))
    )
    path = tmp_path / "swing.avi"
    path.write_bytes(4 * small + large + 2 * small)

    with pytest.raises(FileError, match=r"Frame 5 .* 5000 x 4100 px"):
        find_images(str(path))


def test_a_video_of_an_unknown_codec_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "swing.avi"
    write_video(path)
    path.write_bytes(path.read_bytes().replace(b"MJPG", b"FV1k"))

    with pytest.raises(FileError, match='unsupported codec "FV1K"'):
        find_images(str(path))


def test_the_name_of_a_video_is_no_pattern(tmp_path: Path) -> None:
    path = tmp_path / "swing_%03d.avi"
    write_video(path)

    assert len(find_images(str(path)).names) == 6


@pytest.mark.skipif(sys.platform != "linux", reason="needs names of any bytes")
def test_a_video_whose_name_is_no_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "swing.avi"
    write_video(path)
    renamed = path.rename(tmp_path / os.fsdecode(b"swing\xff.avi"))

    with pytest.raises(FileError, match=r"swing\\udcff.avi is no valid UTF-8"):
        find_images(str(renamed))


def test_a_video_that_is_none_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "swing.avi"
    path.write_bytes(b"RIFF nothing")

    with pytest.raises(FileError, match="cannot be opened"):
        find_images(str(path))


def test_an_empty_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "empty.png"
    path.touch()

    with pytest.raises(FileError, match="empty"):
        read_image(path)


@pytest.mark.parametrize("brightest", [200, 1000, 4095])
def test_a_pgm_states_the_full_scale_of_its_images(
    tmp_path: Path, brightest: int
) -> None:
    kind = ">u2" if brightest > 255 else "u1"
    pixels = np.full(GREY.shape, brightest // 2, kind).tobytes()
    head = f"P5\n{GREY.shape[1]} {GREY.shape[0]}\n{brightest}\n".encode()
    (tmp_path / "a.pgm").write_bytes(head + pixels)
    source = find_images(str(tmp_path))
    assert source.full_scale == brightest
    assert source.of_bits(12).full_scale == 4095


def test_a_pgm_with_exchanged_bytes_is_named(tmp_path: Path) -> None:
    levels = np.full(GREY.shape, 1000, "<u2")
    head = f"P5\n{GREY.shape[1]} {GREY.shape[0]}\n4095\n".encode()
    (tmp_path / "a.pgm").write_bytes(head + levels.tobytes())
    (load,) = find_images(str(tmp_path / "a.pgm")).open()

    with pytest.raises(FileError, match="bytes of each value"):
        load()


@pytest.mark.parametrize("n_bits", [10, 12, 14])
def test_a_png_with_exchanged_bytes_is_named(tmp_path: Path, n_bits: int) -> None:
    levels = np.random.default_rng(1).integers(0, 1 << n_bits, (20, 30))
    path = tmp_path / "a.png"
    for kept in (levels, levels << (16 - n_bits), np.where(levels > 99, 20_000, 0)):
        cv2.imwrite(str(path), kept.astype(np.uint16))
        (load,) = find_images(str(path)).open()
        np.testing.assert_array_equal(load(), kept)
    cv2.imwrite(str(path), levels.astype(np.uint16).byteswap())
    (load,) = find_images(str(path)).open()

    with pytest.raises(FileError, match="bytes of each value"):
        load()


@pytest.mark.parametrize("kind", [2, 3])
@pytest.mark.parametrize("end", ["", "\n"])
def test_numbers_of_an_image_in_text_may_end_the_file(
    tmp_path: Path, kind: int, end: str
) -> None:
    values = GREY if kind == 2 else np.repeat(GREY, 3)
    head = f"P{kind}\n{GREY.shape[1]} {GREY.shape[0]}\n255\n"
    (tmp_path / "a.ppm").write_text(head + " ".join(map(str, values.flat)) + end)

    (load,) = find_images(str(tmp_path)).open()

    np.testing.assert_array_equal(load(), GREY)


@pytest.mark.parametrize("shift", [0, 6])
def test_stated_bits_may_be_at_either_end_of_a_value(
    tmp_path: Path, shift: int
) -> None:
    deep = GREY.astype(np.uint16) * 4
    (tmp_path / "a.png").write_bytes(png(deep * np.uint16(2**shift)))

    (load,) = find_images(str(tmp_path)).of_bits(10).open()

    np.testing.assert_array_equal(load(), deep)


@pytest.mark.parametrize("bits", [10, 11])
def test_more_bits_than_stated_are_refused(tmp_path: Path, bits: int) -> None:
    rng = np.random.default_rng(0)
    deep = rng.integers(0, 4096, (48, 64), np.uint16)
    (tmp_path / "a.png").write_bytes(png(deep))

    (load,) = find_images(str(tmp_path)).of_bits(bits).open()

    with pytest.raises(FileError, match=f"more than {bits} bits hold"):
        load()


def test_bits_scaled_to_16_are_those_stated(tmp_path: Path) -> None:
    levels = np.arange(1024).reshape(32, 32)
    (tmp_path / "a.png").write_bytes(png((levels * 65535 // 1023).astype(np.uint16)))

    (load,) = find_images(str(tmp_path)).of_bits(10).open()

    np.testing.assert_array_equal(load(), levels)


def test_images_that_state_no_full_scale_have_that_of_their_levels() -> None:
    rng = np.random.default_rng(0)
    ramp = np.linspace(0, 1500, 10_000) + rng.normal(0, 8, 10_000)
    deep = np.clip(ramp, 0, None).astype(np.uint16).reshape(100, 100)
    assert full_scale_of(deep) == 4095
    assert full_scale_of(np.minimum(deep, 1023)) == 1023
    assert full_scale_of(np.minimum(deep, 1000)) == 1000  # pixels pile up there
    assert full_scale_of(np.minimum(deep, 255)) == 255
    assert full_scale_of(deep // 8) == 1023  # of 8 bits, if none is clipped
    assert full_scale_of(np.minimum(deep, 255).astype(np.uint8)) == 255


def test_an_uncompressed_video_is_named(tmp_path: Path) -> None:
    path = tmp_path / "raw.avi"
    writer = cv2.VideoWriter(str(path), 0, 20, (64, 48), isColor=False)
    writer.write(GREY)
    writer.release()

    with pytest.raises(FileError, match=r"uncompressed frames.*FFV1"):
        count_frames_in_process(path)


@pytest.mark.parametrize("codec", [b"Y16 ", b"v210"])
def test_an_uncompressed_video_of_more_than_8_bits_is_named(
    tmp_path: Path, codec: bytes
) -> None:
    path = tmp_path / "raw.avi"
    writer = cv2.VideoWriter(str(path), 0, 20, (128, 48), isColor=False)
    for _ in range(3):
        writer.write(np.zeros((48, 128), np.uint8))
    writer.release()
    data = path.read_bytes()
    head, format_chunk, rest = data.partition(b"strf")
    assert format_chunk
    place = 20  # of the code, behind size, width, height, planes and bits
    path.write_bytes(head + b"strf" + rest[:place] + codec + rest[place + 4 :])

    with pytest.raises(FileError, match=r"uncompressed frames.*TIFF, of 16 bits"):
        count_frames_in_process(path)


def mosaic_of(colours: tuple[float, float, float], pattern: str) -> Image:
    """Return the raw image of discs of a colour (red, green, blue)."""
    image: FloatArray = np.zeros((96, 128))
    for x, y in RNG.uniform(20, 76, (6, 2)):
        cv2.circle(image, (round(x), round(y)), 6, 200.0, -1, cv2.LINE_AA)
    image = np.asarray(cv2.GaussianBlur(image, (0, 0), 1.0), np.float64)
    gains = np.array([colours["RGB".index(letter)] for letter in pattern])
    raw = image * np.tile(gains.reshape(2, 2), (48, 64)) + 5
    return np.asarray(raw, np.uint8)


@pytest.mark.parametrize("pattern", ["RGGB", "BGGR", "GRBG", "GBRG"])
@pytest.mark.parametrize(
    "colours", [(0.5, 1.0, 0.6), (1.0, 0.15, 0.05), (0.1, 1.0, 0.1), (0.05, 0.3, 1.0)]
)
def test_raw_images_of_a_colour_camera_are_named(
    tmp_path: Path, colours: tuple[float, float, float], pattern: str
) -> None:
    for i in range(5):
        (tmp_path / f"{i}.png").write_bytes(png(mosaic_of(colours, pattern)))

    with pytest.raises(FileError, match="Bayer"):
        list(look_at_all(find_images(str(tmp_path)), lambda load: load(), 1))


@pytest.mark.parametrize("gains", [(1, 1, 1, 1), (1, 0.9, 1, 0.9), (1, 1, 0.85, 0.85)])
def test_uneven_columns_or_rows_are_no_mosaic(gains: tuple[float, ...]) -> None:
    even = mosaic_of((1.0, 1.0, 1.0), "RGGB").astype(np.float64)
    image = even * np.tile(np.reshape(gains, (2, 2)), (48, 64))

    assert is_mosaic(image.astype(np.uint8)) is False


@pytest.mark.parametrize("suffix", [".jpg", ".png", ".webp", ".tif"])
@pytest.mark.parametrize("tag", [3, 6])
def test_an_orientation_tag_is_said_and_not_applied(
    tmp_path: Path, suffix: str, tag: int
) -> None:
    exif = b"II*\0" + struct.pack("<IHHHIII", 8, 1, 274, 3, 1, tag, 0)
    path = tmp_path / f"turned{suffix}"
    if suffix == ".tif":
        entries = [(256, 64), (257, 48), (258, 8), (259, 1), (262, 1)]
        entries += [(273, 8 + 2 + 9 * 12 + 4), (274, tag), (277, 1), (279, GREY.size)]
        packed = b"".join(
            struct.pack("<HHII", at, 4, 1, value) for at, value in entries
        )
        head = b"II*\0" + struct.pack("<IH", 8, len(entries))
        path.write_bytes(head + packed + bytes(4) + GREY.tobytes())
    else:
        kept = [cv2.IMWRITE_JPEG_QUALITY, 100, cv2.IMWRITE_WEBP_QUALITY, 101]
        data = bytes(cv2.imencode(suffix, GREY, kept)[1])
        path.write_bytes(with_exif(data, suffix, exif))

    source = find_images(str(path))

    remark = str(source.remark())
    assert f"orientation tag {tag}" in remark
    assert "not applied" in remark
    (load,) = source.open()
    assert np.abs(load().astype(int) - GREY).max() <= 4  # rounding of JPEG


def with_exif(data: bytes, suffix: str, exif: bytes) -> bytes:
    """Return a JPEG, PNG or WebP file with an Exif part."""
    if suffix == ".jpg":
        part = b"Exif\0\0" + exif
        return data[:2] + struct.pack(">HH", 0xFFE1, len(part) + 2) + part + data[2:]
    if suffix == ".png":
        part = b"eXIf" + exif
        chunk = (
            struct.pack(">I", len(exif)) + part + struct.pack(">I", zlib.crc32(part))
        )
        return data[:-12] + chunk + data[-12:]  # before the end
    chunk = b"EXIF" + struct.pack("<I", len(exif)) + exif
    return data + chunk


def test_images_without_tag_need_no_remark(folder: Path) -> None:
    assert find_images(str(folder)).remark() is None


@pytest.mark.parametrize("name", ["swing.tif", "swing.png"])
def test_pages_are_read_whatever_the_name_of_their_file(
    tmp_path: Path, name: str
) -> None:
    data = cv2.imencodemulti(".tif", [GREY, GREY // 2])[1]
    (tmp_path / name).write_bytes(data.tobytes())
    (tmp_path / "folder.png").mkdir()

    found = find_images(str(tmp_path))

    assert found.names == ("swing page 1", "swing page 2")
    np.testing.assert_array_equal(list(found.open())[1](), GREY // 2)


def test_a_folder_without_images_says_what_it_has(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="contains no files"):
        find_images(str(tmp_path))
    (tmp_path / "cam0").mkdir()
    with pytest.raises(FileError, match=r"folders: cam0\. Choose"):
        find_images(str(tmp_path))


@pytest.mark.parametrize(
    ("name", "start", "kind"),
    [
        ("swing.avi", b"RIFF\0\0\0\0AVI ", "video"),
        ("f1.heic", b"\0\0\0\x18ftypheic", "HEIC"),
        ("f1.fits", b"SIMPLE  =     T", "FITS"),
        ("f1.dng", b"II*\0\x08\0\0\0", "camera raw"),
        ("f1.NEF", b"MM\0*\0\0\0\x08", "camera raw"),
        ("f1.jls", b"\xff\xd8\xff\xf7", "JPEG-LS"),
        ("f1.raw", bytes(100), "pixels without a header"),
        ("swing.cih", b"#Camera Information Header", "Photron"),
        ("frame_1", b"\x89PNG\r\n\x1a\n", "image"),
        ("f1.xyz", b"something", r"\.xyz"),
    ],
)
def test_a_folder_of_files_of_another_kind_names_it(
    tmp_path: Path, name: str, start: bytes, kind: str
) -> None:
    (tmp_path / "a notes.txt").write_text("swing 3", encoding="utf-8")
    (tmp_path / name).write_bytes(start)
    if name == "f1.xyz":
        (tmp_path / "a notes.txt").unlink()

    with pytest.raises(FileError, match=rf"{name} is of the kind {kind}.*a video"):
        find_images(str(tmp_path))


@pytest.mark.parametrize(
    ("names", "is_named"),
    [
        (("cam0_{:04d}", "cam1_{:04d}"), True),
        (("Basler_23057032_{}", "Basler_23057033_{}"), True),
        (("{:04d}_left", "{:04d}_right"), True),
        (("{:04d}_cam1", "{:04d}_cam2", "{:04d}_cam3"), True),
        (("frame_{:04d}",), False),
        (("first_{}", "second_1{}"), False),
        (("10-15-22_{}50", "10-15-23_{}50"), False),
        (("image (1)", "image (2)"), False),
    ],
)
def test_images_of_several_cameras_are_named_as_the_cause(
    names: tuple[str, ...], is_named: bool
) -> None:
    numbers = range(10)
    files = [Path(f"{name.format(i)}.png") for i in numbers for name in names]
    remark = cameras_remark(files)
    assert (remark is not None) == is_named
    if remark is not None:
        assert f"in {len(names)} series" in str(remark)
        assert files[0].name in str(remark)
