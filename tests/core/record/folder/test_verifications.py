"""Files of verifications: what is read of them, and what is refused."""

from pathlib import Path
from typing import Any

import pytest

from lightpen.errors import FileError
from lightpen.formats.own_json import record_bytes
from lightpen.record.folder import read_verification

FILE = Path("000001.json")
RECORD: dict[str, Any] = {
    "program": {"name": "lightpen", "version": "1.0.0"},
    "created": "2026-01-02T12:00:00+00:00",
    "verification": "fixed point",
}


def test_measured_conditions_and_cameras_are_read() -> None:
    conditions = {"temperature_c": 20.5, "humidity_percent": 45.0}
    content = record_bytes({**RECORD, **conditions, "camera_serials": ["K-1"]})
    done = read_verification(content, FILE)
    assert (done.temperature_c, done.humidity_percent) == (20.5, 45.0)
    assert done.camera_serials == ("K-1",)
    without = read_verification(record_bytes(RECORD), FILE)
    assert (without.temperature_c, without.camera_serials) == (None, ())


@pytest.mark.parametrize(
    "entry",
    [{"temperature_c": "warm"}, {"humidity_percent": []}, {"camera_serials": 5}],
    ids=lambda entry: next(iter(entry)),
)
def test_an_entry_of_another_type_is_damage(entry: dict[str, Any]) -> None:
    with pytest.raises(FileError, match="damaged"):
        read_verification(record_bytes({**RECORD, **entry}), FILE)
