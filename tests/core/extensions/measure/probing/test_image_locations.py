"""Tests of `lightpen_extensions.measure.probing.sources`."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from lightpen.errors import FileError
from lightpen.formats.files import mark_simulated
from lightpen.model.names import Origin
from lightpen.model.rigid import Rig, rig_of
from lightpen_extensions.measure.probing.sources import touch_place
from lightpen_extensions.simulator.swings import paper_camera

ONE = rig_of(paper_camera())
TWO = replace(
    ONE,
    cameras=2 * ONE.cameras,
    rotations=np.tile(np.eye(3), (2, 1, 1)),
    translations=np.zeros((2, 3)),
    names=("left", "right"),
)


def write_images(folder: Path) -> None:
    folder.mkdir(parents=True)
    for number in (1, 2):
        assert cv2.imwrite(str(folder / f"{number}.png"), np.zeros((4, 4), np.uint8))


def test_a_run_of_two_cameras_has_the_images_of_each(tmp_path: Path) -> None:
    write_images(tmp_path / "run" / "left")
    write_images(tmp_path / "run" / "right")

    found = touch_place((str(tmp_path / "run"),), TWO)

    assert [len(each.files) for each in found.images] == [2, 2]
    assert {file.parent.name for file in found.images[1].files} == {"right"}
    assert found.masks == (None, None)


@pytest.mark.parametrize("rig", [None, ONE], ids=["no rig", "one camera"])
def test_a_run_of_one_camera_is_its_folder_alone(
    tmp_path: Path, rig: Rig | None
) -> None:
    write_images(tmp_path / "run")

    (images,) = touch_place((str(tmp_path / "run"),), rig).images

    assert len(images.files) == 2


def test_the_bit_depth_is_that_of_the_images_of_each_camera(tmp_path: Path) -> None:
    write_images(tmp_path / "run" / "left")
    write_images(tmp_path / "run" / "right")
    found = touch_place((str(tmp_path / "run"),), TWO)

    assert [each.full_scale for each in found.of_bits(10).images] == [1023, 1023]
    assert [each.full_scale for each in found.of_bits(None).images] == [None, None]


def test_a_run_without_the_images_of_a_camera_is_refused(tmp_path: Path) -> None:
    write_images(tmp_path / "run" / "left")

    with pytest.raises(FileError, match="right"):
        touch_place((str(tmp_path / "run"),), TWO)


def test_the_places_of_each_camera_can_be_given_apart(tmp_path: Path) -> None:
    places = [str(tmp_path / name) for name in ("one", "other")]
    for place in places:
        write_images(Path(place))

    found = touch_place(tuple(places), TWO)

    assert [each.files[0].parent.name for each in found.images] == ["one", "other"]
    assert found.name == places[0]
    assert len(found.files) == 4
    assert (found.origin, found.held, found.viewers) == (Origin.RECORDED, (), None)
    for wrong in (places[:1], [*places, places[0]]):
        with pytest.raises(FileError, match="left, right"):
            touch_place(tuple(wrong), TWO)


def test_images_of_a_simulated_camera_say_so(tmp_path: Path) -> None:
    write_images(tmp_path / "run")
    mark_simulated(tmp_path / "run")

    assert touch_place((str(tmp_path / "run"),)).origin is Origin.SIMULATED
