import os
from collections.abc import Callable, Iterator
from functools import partial
from itertools import chain, repeat
from math import inf
from pathlib import Path

import cv2
import numpy as np
import pytest

from lightpen.arrays import Image
from lightpen.cameras.protocol import (
    DeviceLost,
    DeviceNotFound,
    EndOfImages,
    Frame,
    FrameIncomplete,
)
from lightpen.cameras.replay import ReplayCamera
from lightpen.errors import FileError
from lightpen.formats.decoding import encode_png
from lightpen.formats.images import ImageSource
from lightpen.messages import message
from lightpen_extensions.simulator.camera import SkippingClock

N_IMAGES = 5


def write_images(folder: Path) -> list[Image]:
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(0)
    images: list[Image] = []
    for i in range(N_IMAGES):
        image = rng.integers(256, size=(20, 30), dtype=np.uint8)
        (folder / f"frame_{i}.png").write_bytes(encode_png(image))
        images.append(image)
    return images


def opened(
    where: Path, *, frame_rate: float = 20.0, clock: SkippingClock | None = None
) -> ReplayCamera:
    clock = clock or SkippingClock()
    camera = ReplayCamera(str(where), frame_rate=frame_rate, clock=clock)
    camera.open()
    camera.start()
    return camera


def read_all(camera: ReplayCamera) -> list[Frame]:
    frames = []
    while True:
        try:
            frames.append(camera.read(1.0))
        except EndOfImages:
            return frames


def test_the_images_come_in_order_to_the_last_bit_and_then_end(tmp_path: Path) -> None:
    images = write_images(tmp_path)
    camera = opened(tmp_path)
    frames = read_all(camera)

    assert len(frames) == N_IMAGES
    for frame, image in zip(frames, images, strict=True):
        np.testing.assert_array_equal(frame.image, image)
    with pytest.raises(EndOfImages):
        camera.read(1.0)


def test_a_new_start_begins_with_the_first_image(tmp_path: Path) -> None:
    images = write_images(tmp_path)
    camera = opened(tmp_path)
    for _ in range(2):
        camera.read(1.0)
    camera.stop()
    camera.start()
    frames = read_all(camera)

    assert len(frames) == N_IMAGES
    np.testing.assert_array_equal(frames[0].image, images[0])
    assert frames[0].seq == 2


def test_a_loop_begins_anew_after_the_last_image(tmp_path: Path) -> None:
    images = write_images(tmp_path)
    camera = ReplayCamera(str(tmp_path), loops=True, clock=SkippingClock())
    camera.open()
    camera.start()
    frames = [camera.read(1.0) for _ in range(2 * N_IMAGES + 1)]

    np.testing.assert_array_equal(frames[-1].image, images[0])
    assert [frame.seq for frame in frames] == list(range(2 * N_IMAGES + 1))


def test_images_come_at_the_frame_rate(tmp_path: Path) -> None:
    write_images(tmp_path)
    frames = read_all(opened(tmp_path, frame_rate=10.0))

    gaps = np.diff([frame.host_ts_ns for frame in frames])
    np.testing.assert_array_equal(gaps, 100_000_000)


def test_images_come_as_fast_as_asked_without_a_rate(tmp_path: Path) -> None:
    write_images(tmp_path)
    clock = SkippingClock()
    read_all(opened(tmp_path, frame_rate=inf, clock=clock))

    assert clock.now_ns() == 0


def test_a_late_reader_loses_no_image_and_is_not_hurried(tmp_path: Path) -> None:
    write_images(tmp_path)
    clock = SkippingClock()
    camera = opened(tmp_path, clock=clock)
    camera.read(1.0)
    clock.wait(3.0)
    frames = read_all(camera)

    assert len(frames) == N_IMAGES - 1
    gaps = np.diff([frame.host_ts_ns for frame in frames])
    assert gaps[0] == 0  # this one was due long ago
    np.testing.assert_array_equal(gaps[1:], 50_000_000)


def test_images_are_found_in_the_subfolder_of_a_recorded_set(tmp_path: Path) -> None:
    write_images(tmp_path / "images")
    (tmp_path / "camera.yaml").touch()

    assert len(read_all(opened(tmp_path))) == N_IMAGES


def test_images_may_come_from_any_source() -> None:
    def loaders() -> Iterator[Callable[[], Image]]:
        for i in range(3):
            yield partial(np.full, (4, 6), i, np.uint16)

    camera = ReplayCamera(
        "swing 17", lambda: ImageSource(("a", "b", "c"), (), loaders), frame_rate=inf
    )
    camera.open()
    camera.start()
    frames = read_all(camera)

    assert [int(frame.image[0, 0]) for frame in frames] == [0, 1, 2]
    assert {frame.pixel_format for frame in frames} == {"Mono16"}
    assert {frame.full_scale for frame in frames} == {1023}  # the least of 16 bits


def test_a_folder_that_is_not_there_is_not_found(tmp_path: Path) -> None:
    camera = ReplayCamera(str(tmp_path / "nowhere"))
    with pytest.raises(DeviceNotFound, match="nowhere"):
        camera.open()


def test_a_source_without_images_is_not_found() -> None:
    camera = ReplayCamera("swing 17", lambda: ImageSource((), (), lambda: iter(())))
    with pytest.raises(DeviceNotFound, match="swing 17 contains no images"):
        camera.open()


def test_a_damaged_image_is_named_and_the_next_one_comes(tmp_path: Path) -> None:
    write_images(tmp_path)
    path = tmp_path / "frame_1.png"
    path.write_bytes(path.read_bytes()[:-20])
    camera = opened(tmp_path)
    camera.read(1.0)
    with pytest.raises(FrameIncomplete, match=r"frame_1\.png"):
        camera.read(1.0)
    frames = read_all(camera)

    assert [frame.seq for frame in frames] == [2, 3, 4]
    assert camera.stats().incomplete == 1
    assert camera.stats().delivered == 4


@pytest.mark.parametrize("frame_rate", [20.0, inf])
def test_a_folder_that_is_gone_is_a_lost_camera_until_it_is_back(
    tmp_path: Path, frame_rate: float
) -> None:
    folder, elsewhere = tmp_path / "swing", tmp_path / "elsewhere"
    images = write_images(folder)
    camera = opened(folder, frame_rate=frame_rate)
    camera.read(1.0)
    folder.rename(elsewhere)
    with pytest.raises(DeviceLost, match=r"Images of .* are no longer readable"):
        camera.read(1.0)
    camera.close()
    with pytest.raises(DeviceNotFound):
        camera.open()

    elsewhere.rename(folder)
    camera.open()
    camera.start()
    np.testing.assert_array_equal(camera.read(1.0).image, images[0])


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="an open file stays where it is there")
def test_a_video_that_is_gone_is_a_lost_camera(tmp_path: Path) -> None:
    path = tmp_path / "swing.avi"
    writer = cv2.VideoWriter(
        str(path), cv2.VideoWriter.fourcc(*"FFV1"), 20.0, (64, 48), isColor=False
    )
    for _ in range(N_IMAGES):
        writer.write(np.zeros((48, 64), np.uint8))
    writer.release()
    camera = ReplayCamera(str(path), loops=True, clock=SkippingClock())
    camera.open()
    camera.start()
    camera.read(1.0)
    path.rename(tmp_path / "elsewhere.avi")

    read_all_but_lost = partial(read_all, camera)  # the file is open for a round yet
    with pytest.raises(DeviceLost, match=r"swing\.avi"):
        read_all_but_lost()


def test_a_whole_round_of_damaged_images_is_a_lost_camera() -> None:
    def damaged() -> Image:
        raise FileError(message("image.wrong-checksum", name="a.png"))

    def loaders() -> Iterator[Callable[[], Image]]:
        good = partial(np.full, (4, 6), 0, np.uint8)
        yield from chain(repeat(damaged, 2), [good], repeat(damaged, 2))

    first = partial(np.full, (4, 6), 0, np.uint8)
    turns = iter([iter([first]), loaders(), iter([damaged] * 5)])
    source = ImageSource(tuple("abcde"), (), lambda: next(turns))
    camera = ReplayCamera(
        "swing 17", lambda: source, loops=True, frame_rate=inf, clock=SkippingClock()
    )
    camera.open()
    camera.start()
    outcomes: list[type] = []
    while DeviceLost not in outcomes:
        try:
            outcomes.append(type(camera.read(1.0)))
        except (FrameIncomplete, DeviceLost) as error:
            outcomes.append(type(error))

    bad = FrameIncomplete
    assert outcomes == [bad, bad, Frame, bad, bad, bad, bad, DeviceLost]


def test_an_image_of_another_size_is_refused(tmp_path: Path) -> None:
    write_images(tmp_path)
    (tmp_path / "frame_1.png").write_bytes(encode_png(np.zeros((10, 10), np.uint8)))
    camera = opened(tmp_path)
    camera.read(1.0)
    with pytest.raises(FrameIncomplete, match=r"frame_1\.png is 10 x 10 px.* 30 x 20"):
        camera.read(1.0)


@pytest.mark.parametrize("number", [0, 3])
def test_an_image_of_another_depth_comes_as_it_is(tmp_path: Path, number: int) -> None:
    images = write_images(tmp_path)
    images[number] = images[number].astype(np.uint16) * 257
    (tmp_path / f"frame_{number}.png").write_bytes(encode_png(images[number]))
    frames = read_all(opened(tmp_path))

    assert len(frames) == N_IMAGES
    for i, (frame, image) in enumerate(zip(frames, images, strict=True)):
        np.testing.assert_array_equal(frame.image, image)
        expected = ("Mono16", 65535) if i == number else ("Mono8", 255)
        assert (frame.pixel_format, frame.full_scale) == expected


@pytest.mark.parametrize(
    "spoiled",
    [b"no image", encode_png(np.zeros((10, 10), np.uint8))],
    ids=["unreadable", "of another size"],
)
def test_a_first_image_unlike_the_others_costs_none_but_itself(
    tmp_path: Path, spoiled: bytes
) -> None:
    write_images(tmp_path)
    (tmp_path / "frame_0.png").write_bytes(spoiled)
    camera = opened(tmp_path)

    assert (camera.caps.width, camera.caps.height) == (30, 20)
    with pytest.raises(FrameIncomplete, match=r"frame_0\.png"):
        camera.read(1.0)
    assert [frame.seq for frame in read_all(camera)] == [1, 2, 3, 4]


def test_a_folder_of_which_no_image_can_be_read_is_not_found(tmp_path: Path) -> None:
    for name in ("1.png", "2.png"):
        (tmp_path / name).write_bytes(b"no image")
    with pytest.raises(DeviceNotFound, match=r"1\.png"):
        ReplayCamera(str(tmp_path)).open()
