"""Test the import without PySide's reading of sources."""

import builtins
import inspect
import sys
from importlib import import_module
from pathlib import Path

import PySide6.QtCore
import pytest

from lightpen_app.plain_import import use_plain_import


def test_the_source_of_a_module_is_not_read_once_more(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert PySide6.QtCore.qVersion()
    for name in ("before", "after"):
        text = f"def here():\n    import lightpen_inner_{name}\n"
        (tmp_path / f"lightpen_outer_{name}.py").write_text(text, encoding="utf-8")
        (tmp_path / f"lightpen_inner_{name}.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(builtins, "__import__", builtins.__import__)
    read: list[str] = []
    source_of = inspect.getsource

    def noted(module: object) -> str:
        read.append(getattr(module, "__name__", ""))
        return source_of(module)  # type: ignore[arg-type]

    monkeypatch.setattr(inspect, "getsource", noted)

    import_module("lightpen_outer_before").here()
    assert read == ["lightpen_inner_before"]  # as PySide does

    read.clear()
    use_plain_import()
    import_module("lightpen_outer_after").here()
    assert not read
    assert "lightpen_inner_after" in sys.modules
