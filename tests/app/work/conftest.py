"""A run of its own, and what a swing is captured with."""

import shutil
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest
from PySide6.QtWidgets import QApplication

from lightpen.formats.opened_files import CameraFile, PenFile
from lightpen.record.swings.header import Names
from lightpen.swing.preparation import Preparation
from lightpen_app.work.job import Notifications
from lightpen_app.work.swing_run import SwingRun
from lightpen_extensions.simulator.scene_files import write_sample_files
from lightpen_extensions.simulator.scenes import Scene

NOON = datetime(2031, 5, 1, 12, tzinfo=UTC)


@pytest.fixture(scope="session")
def prepared(
    small_scene: Scene, tmp_path_factory: pytest.TempPathFactory
) -> Preparation:
    """All that a swing of the small scene needs."""
    files = write_sample_files(small_scene, tmp_path_factory.mktemp("files"))
    return Preparation(
        names=Names("Hall 2", "Ann", "LP-04", "T-10", "C-1", 10.0),
        camera_file=CameraFile.read(files.camera),
        pen_file=PenFile.read(files.pen),
    )


@pytest.fixture
def notifications(qapp: QApplication) -> Notifications:
    """What is published by a run and a live view."""
    return Notifications()


@pytest.fixture
def run(
    tmp_path: Path, qapp: QApplication, notifications: Notifications
) -> Iterator[SwingRun]:
    """A run without a camera; it goes by the same moment always."""
    run = SwingRun(tmp_path / "run", lambda: NOON, notifications)
    yield run
    run.runner.shut_down()
    assert run.runner.await_end(60.0)
    QApplication.processEvents()


@pytest.fixture
def interrupted(run: SwingRun, swung: Callable[..., Path]) -> Path:
    """An interrupted swing of 20 images among the records of the run."""
    folder = run.records_folder / "interrupted"
    shutil.copytree(swung(), folder)
    return folder
