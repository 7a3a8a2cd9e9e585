"""What of the lock file goes into the Windows installer."""

import re
from pathlib import Path

import pytest
from installer import runtime
from installer.build import shipped_pins
from installer.bundled import EXTRAS, extra_requirements
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


def test_the_installed_program_has_the_extras_that_a_station_can_need() -> None:
    shipped = {pin.name for pin in shipped_pins()}
    assert {"numpy", "genicam", "harvesters", "pyigtl", "crcmod"} <= shipped
    assert {"psycopg-binary", "python-calamine"} <= shipped


def test_packages_of_linux_have_the_same_extras_each_with_its_hashes() -> None:
    lock = Path(__file__).parents[2] / "requirements-dev.lock"
    requirements = extra_requirements(lock.read_text("utf-8"))

    entries = re.split(r"^(?=[\w-]+==)", lock.read_text("utf-8"), flags=re.MULTILINE)
    words_of = {e.partition("==")[0]: set(re.split(r"[\s#]+", e)) for e in entries}
    program = lock.with_name("requirements.lock").read_text("utf-8")
    needed = {name for name, words in words_of.items() if words & EXTRAS - {name}}
    assert {name for name in needed if f"{name}==" not in program} <= EXTRAS
    named = re.findall(r"^([\w-]+)==", requirements, re.MULTILINE)
    assert set(named) == EXTRAS
    assert all(len(pin.hashes) > 0 for pin in windows_pins(requirements, "3.13.2"))


def test_the_lock_file_itself_gives_one_version_of_each() -> None:
    lock = Path(__file__).parents[2] / "requirements.lock"
    names = [pin.name for pin in windows_pins(lock.read_text("utf-8"), runtime.VERSION)]

    assert sorted(set(names)) == sorted(names)
    assert {"numpy", "pyside6-essentials", "opencv-python-headless"} <= set(names)
