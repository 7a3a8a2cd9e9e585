"""Times in the zone of the machine, whatever its TZ says."""

import os
import subprocess
import sys

import pytest

needs_posix = pytest.mark.skipif(os.name == "nt", reason="needs POSIX")
TOLD = "from lightpen.local_time import local_now; print(local_now().utcoffset())"


def offset_in(zone: str) -> str:
    """Return the time zone that a program in such an environment counts with."""
    reported = subprocess.run(
        [sys.executable, "-c", TOLD],
        env={**os.environ, "TZ": zone},
        capture_output=True,
        encoding="utf-8",
        check=True,
    )
    return reported.stdout.strip()


@needs_posix
def test_a_time_has_the_zone_of_the_machine() -> None:
    assert offset_in("AAA-3") == "3:00:00"


@needs_posix
@pytest.mark.parametrize("zone", ["AAA+99", "AAA-25", "AAA24:59:59"])
def test_a_zone_a_day_away_is_none(zone: str) -> None:
    assert offset_in(zone) == "0:00:00"
