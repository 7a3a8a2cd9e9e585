"""Tests of finding which images are of the same moment."""

import pytest

from lightpen.errors import FileError
from lightpen.formats.observation_files import pair_images

CAMERAS = ("left", "right")


def pairs(*names: list[str]) -> list[list[int]]:
    found: list[list[int]] = pair_images(names, CAMERAS).images.tolist()
    return found


def test_images_of_the_same_name_are_of_the_same_moment() -> None:
    assert pairs(["a.png", "b.png"], ["a.bmp", "b.bmp"]) == [[0, 0], [1, 1]]


def test_an_image_without_partner_stands_alone_in_its_place() -> None:
    found = pairs(["i1.png", "i2.png", "i10.png"], ["i2.png", "i3.png", "i10.png"])

    assert found == [[0, -1], [1, 0], [-1, 1], [2, 2]]


def test_names_of_the_cameras_do_not_keep_numbers_from_pairing() -> None:
    assert pairs(["left_07.png", "left_8.png"], ["right_7.png"]) == [[0, 0], [1, -1]]


def test_names_that_tell_nothing_leave_the_order() -> None:
    found = pair_images((["1700", "1733"], ["1702", "1735"]), CAMERAS)

    assert found.images.tolist() == [[0, 0], [1, 1]]
    assert found.by_order
    assert not pair_images((["1", "2"], ["1", "2"]), CAMERAS).by_order


def test_other_numbers_of_images_without_telling_names_are_refused() -> None:
    with pytest.raises(FileError, match="2 images of right and 3 of left") as info:
        pair_images((["a.png", "b.png", "c.png"], ["x.png", "y.png"]), CAMERAS)
    assert "the same name or number" in str(info.value)
