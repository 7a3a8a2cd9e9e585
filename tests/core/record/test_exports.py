"""A solved swing for use elsewhere."""

import csv
import json
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import pytest

from lightpen.model.origin import Origin
from lightpen.record.exports import (
    export_json,
    export_stem,
    export_tables,
    save_new,
    tip_text,
)
from lightpen.record.names import Names
from lightpen.record.reading import open_record, recorded_names
from lightpen.record.solving import Solution, solve_record


@pytest.fixture(scope="module")
def solution(swung: Callable[..., Path]) -> Solution:
    return solve_record(open_record(swung()))


@pytest.mark.parametrize(
    ("names", "origin", "stem"),
    [
        (Names(pen="LP-04", tip="T-10"), Origin.LIVE, "LP-04_T-10_2026-01-02"),
        (Names(pen="a/b", tip="../x"), None, "a-b_..-x_2026-01-02"),
        (Names(), Origin.SIMULATED, "2026-01-02_SIMULATED"),
        (Names(pen="A"), Origin.RECORDED, "A_2026-01-02_RECORDED"),
    ],
)
def test_files_are_named_by_pen_tip_date_and_what_is_not_live(
    names: Names, origin: Origin | None, stem: str
) -> None:
    assert export_stem(names, datetime(2026, 1, 2, tzinfo=UTC), origin) == stem


def test_no_file_is_written_over(tmp_path: Path) -> None:
    saved = [save_new(tmp_path, "a.csv", data) for data in (b"1", b"2", b"3")]

    assert [path.name for path in saved] == ["a.csv", "a-2.csv", "a-3.csv"]
    assert [path.read_bytes() for path in saved] == [b"1", b"2", b"3"]


def test_tip_and_images_are_tables(solution: Solution, tmp_path: Path) -> None:
    names = recorded_names(open_record(solution.source.folder))
    export_tables(solution, names, tmp_path, "x")

    with (tmp_path / "x_tip.csv").open(encoding="utf-8") as file:
        (row,) = csv.DictReader(file)
    tip = solution.calibration.joint.tip_pen.tolist()
    assert [float(row[f"tip_{axis}_mm"]) for axis in "xyz"] == tip
    assert (row["pen"], row["tip"], row["origin"]) == ("LP-04", "T-10", "simulated")
    with (tmp_path / "x_images.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["image"]) for row in rows] == solution.numbers.tolist()
    copied = list(map(repr, tip))
    assert tip_text(solution, Origin.LIVE).split("\t") == copied
    assert tip_text(solution, Origin.RECORDED).split("\t") == [*copied, "RECORDED"]


def test_the_record_is_that_of_the_command_line(
    solution: Solution, tmp_path: Path, lightpen: Callable[..., object]
) -> None:
    export_json(solution, tmp_path, "x")
    lightpen("calibrate", solution.source.folder, "--json", tmp_path / "y.json")

    saved, printed = (
        json.loads((tmp_path / name).read_bytes())
        for name in ("x_calibration.json", "y.json")
    )
    for each in (saved, printed):
        del each["created"], each["checksum"]
    assert saved == printed
    assert saved["origin"] == "simulated"
