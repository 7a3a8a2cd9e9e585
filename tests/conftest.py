"""Fixtures that every test may use."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Return the folder of image sets with truth, or skip the test without it."""
    folder = os.environ.get("LIGHTPEN_DATA")
    if folder is None:
        pytest.skip("LIGHTPEN_DATA does not name the folder of test image sets")
    path = Path(folder).resolve()
    if not (path / "swing-clean").is_dir():
        pytest.fail(f"LIGHTPEN_DATA={folder} holds no folder swing-clean")
    return path
