"""What of the lock file goes into the Windows installer."""

from pathlib import Path

import pytest
from installer import runtime
from installer.build import shipped_pins
from installer.locked import windows_pins

LOCK = """\
colorama==0.4.6 \\
    --hash=sha256:aa \\
    --hash=sha256:bb
    # via tqdm
numpy==2.4.6 ; python_full_version < '3.12' \\
    --hash=sha256:cc
numpy==2.5.5 ; python_full_version >= '3.12' \\
    --hash=sha256:dd
dbus==1.0 ; sys_platform == 'linux' \\
    --hash=sha256:ee
"""


def test_only_what_windows_and_its_python_need_is_taken() -> None:
    lines = [pin.line() for pin in windows_pins(LOCK, "3.13.2")]

    assert lines == [
        "colorama==0.4.6 --hash=sha256:aa --hash=sha256:bb",
        "numpy==2.5.5 --hash=sha256:dd",
    ]


def test_another_python_gets_other_versions() -> None:
    pins = windows_pins(LOCK, "3.11.9")

    assert [pin.version for pin in pins if pin.name == "numpy"] == ["2.4.6"]


@pytest.mark.parametrize(
    "entry", ["numpy>=2 --hash=sha256:aa\n", "numpy==2.4.6\n"], ids=["range", "bare"]
)
def test_what_is_not_pinned_by_hash_is_refused(entry: str) -> None:
    with pytest.raises(ValueError, match="numpy of the lock file is not pinned"):
        windows_pins(entry, "3.13.2")


def test_the_installed_program_can_use_industrial_cameras() -> None:
    shipped = {pin.name for pin in shipped_pins()}
    assert {"numpy", "genicam", "harvesters", "pyigtl", "crcmod"} <= shipped


def test_the_lock_file_itself_gives_one_version_of_each() -> None:
    lock = Path(__file__).parents[2] / "requirements.lock"
    names = [pin.name for pin in windows_pins(lock.read_text("utf-8"), runtime.VERSION)]

    assert sorted(set(names)) == sorted(names)
    assert {"numpy", "pyside6-essentials", "opencv-python-headless"} <= set(names)
