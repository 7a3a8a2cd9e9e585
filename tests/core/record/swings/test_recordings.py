"""What stands beside recorded images, and whether they were simulated."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from lightpen.formats.files import MARK
from lightpen.record.swings.solving import (
    FilesBeside,
    files_beside,
    is_simulated_recording,
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder of images with the files that go with them."""
    (tmp_path / "images").mkdir()
    for name in ("camera.yaml", "leds.csv", "images/1.png", "other.csv"):
        (tmp_path / name).touch()
    return tmp_path


@pytest.mark.parametrize("place", ["", "images", "images/*.png", "film.mp4"])
def test_camera_and_pen_file_are_found_beside_the_images(
    folder: Path, place: str
) -> None:
    found = files_beside(str(folder / place))
    assert found == FilesBeside(folder / "camera.yaml", folder / "leds.csv")


def test_a_camera_file_in_place_of_images_is_offered_whatever_its_name(
    folder: Path,
) -> None:
    own = folder / "hall 2.yaml"
    own.touch()
    assert files_beside(str(own)) == FilesBeside(own, folder / "leds.csv")


def test_where_there_are_none_none_are_found(tmp_path: Path) -> None:
    assert files_beside(str(tmp_path)) == FilesBeside()
    assert files_beside(str(tmp_path / "missing")) == FilesBeside()
    assert files_beside("\0") == FilesBeside()


def test_a_swing_brings_its_own_files(swung: Callable[..., Path]) -> None:
    found = files_beside(str(swung()))
    assert found == FilesBeside(swung() / "camera.yaml", swung() / "pen.json")


def test_images_are_simulated_where_the_mark_or_the_swing_says_so(
    folder: Path, swung: Callable[..., Path], tmp_path: Path
) -> None:
    assert not is_simulated_recording(str(folder / "images"))
    (folder / MARK).touch()
    assert is_simulated_recording(str(folder / "images"))
    assert is_simulated_recording(str(folder))

    swing = tmp_path / "a" / "b" / "c" / "swing"
    shutil.copytree(swung(), swing)
    assert is_simulated_recording(str(swing))
    assert is_simulated_recording(str(swing / "images"))
