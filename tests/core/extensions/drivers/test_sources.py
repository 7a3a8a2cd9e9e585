"""The table of sources: each says what it lacks, and why it cannot be opened."""

import ctypes
import os
from importlib.machinery import ModuleSpec
from pathlib import Path

import pytest

from lightpen.cameras.pairing import MachineClock
from lightpen.cameras.protocol import DeviceNotFound, ImageCamera
from lightpen.cameras.source import SourcePlace
from lightpen.cameras.sources import SOURCES, absent_sources, source_named
from lightpen_extensions.drivers import aravis as aravis_library
from lightpen_extensions.drivers import genicam

NOWHERE = SourcePlace("none-of-this-name")


def camera(key: str, place: SourcePlace) -> ImageCamera:
    source = source_named(key)
    assert source is not None
    assert source.camera is not None
    return source.camera(place, MachineClock())


def no_module(name: str) -> ModuleSpec | None:
    return None


def no_library(name: str) -> ctypes.CDLL:
    raise OSError(name)


def test_every_source_has_a_key_of_its_own() -> None:
    keys = [source.key for source in SOURCES]

    assert len(set(keys)) == len(keys)
    assert [source_named(key) for key in keys] == list(SOURCES)
    assert source_named("of a later version") is None


def test_a_library_that_is_not_installed_is_a_line_that_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(genicam, "find_spec", no_module)
    monkeypatch.setattr(ctypes, "CDLL", no_library)
    aravis_library.load_aravis.cache_clear()
    try:
        absent = absent_sources()
        reported = {key: str(why_absent) for key, why_absent in absent.items()}
        for key in absent:
            with pytest.raises(DeviceNotFound, match="is not installed"):
                camera(key, NOWHERE).open()
    finally:
        aravis_library.load_aravis.cache_clear()

    assert set(reported) == {"aravis", "genicam"}
    assert "apt-get install libaravis-0.8-0" in reported["aravis"]
    assert "pip install harvesters genicam" in reported["genicam"]


def test_a_serial_number_that_no_camera_has_is_reported(genicam: SourcePlace) -> None:
    place = SourcePlace(NOWHERE.name, genicam.producer)
    with pytest.raises(DeviceNotFound, match="no camera none-of-this-name"):
        camera("genicam", place).open()


def test_the_cameras_of_a_producer_are_found(genicam: SourcePlace) -> None:
    source = source_named("genicam")
    assert source is not None
    found = source.find(genicam.producer)

    assert [device.place for device in found] == ["0", "1", "2"]
    assert "Viky" in found[0].label


def test_a_producer_that_does_not_load_is_reported_with_its_message(
    genicam: SourcePlace, tmp_path: Path
) -> None:
    producer = tmp_path / "vendor.cti"
    producer.write_bytes(b"no library")
    source = source_named("genicam")
    assert source is not None
    why = "Failed to load CTI file" if os.name == "nt" else "file too"
    with pytest.raises(DeviceNotFound, match=rf"vendor\.cti does not load: .*{why}"):
        source.find(str(producer))


def test_producers_are_found_where_the_system_says(
    genicam: SourcePlace, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    source = source_named("genicam")
    assert source is not None
    monkeypatch.delenv("GENICAM_GENTL64_PATH", raising=False)
    with pytest.raises(DeviceNotFound, match="GENICAM_GENTL64_PATH"):
        source.find("")
    folders = (str(tmp_path), str(Path(genicam.producer).parent))
    monkeypatch.setenv("GENICAM_GENTL64_PATH", os.pathsep.join(folders))

    assert len(source.find("")) == 3


def test_a_webcam_that_is_not_there_is_reported() -> None:
    with pytest.raises(DeviceNotFound, match="no camera none-of-this-name"):
        camera("webcam", NOWHERE).open()
