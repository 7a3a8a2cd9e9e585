"""The record of a calibration on paper, in both languages, and as PDF/A."""

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import UTC, date, datetime
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest
from benchmarks.small_records import record_of
from msgspec import structs
from PySide6.QtWidgets import QApplication

from lightpen.formats.own_json import StoredMessage
from lightpen.messages import message
from lightpen.model.names import Laboratory, Origin
from lightpen.record.calibrations import OVERDUE, RETIRED, TracedItem
from lightpen.record.library.entered_files import EntryPlace
from lightpen.record.library.tip_library import ItemKind, ListedPen
from lightpen.record.results.results import Result, TipChange, result_bytes
from lightpen_app.look.languages import LanguageSwitch, worded
from lightpen_app_extensions.report.pages import PrintReport, pdf_of

HASHES = re.compile(r"(?<![A-Za-z0-9])[0-9a-f]+(?![A-Za-z0-9])")  # and parts of them

Printed = Callable[..., PrintReport]
Words = Callable[[PrintReport], list[list[str]]]


@pytest.fixture
def chinese(qapp: QApplication) -> Iterator[None]:
    switch = LanguageSwitch(qapp)
    switch.set_language("zh_CN")
    yield
    switch.remove()


def test_every_page_says_of_what_it_is_and_how_many_there_are(
    doubted: Result, printed: Printed, words: Words
) -> None:
    pages = words(printed(doubted))
    digest = sha256(result_bytes(doubted, "records/1")).hexdigest()

    assert len(pages) > 2
    for number, page in enumerate(pages, 1):
        assert f"Page {number} of {len(pages)}" in page
        assert "Pen LP-04, tip T-10, cone C-1" in page
        assert f"SHA-256 of the JSON file: {digest}" in page
        assert {"RECORDED", "CHECK"} <= set(page)
    assert pages[-1].count("— End of report —") == 1


def test_the_report_says_by_its_formula_which_tip_it_states(
    result: Result, printed: Printed, words: Words
) -> None:
    reported = " ".join(" ".join(page) for page in words(printed(result)))

    formula = "min over x, c of sum |R_i x + T_i - c|\xb2"
    assert formula.replace(" ", "") in reported.replace(" ", "")


def test_a_tip_that_passed_before_a_live_camera_has_no_mark(
    result: Result, printed: Printed
) -> None:
    assert printed(result).margins.badges == ()
    simulated = replace(result, origin=Origin.SIMULATED)
    assert printed(simulated).margins.badges == ("SIMULATED",)


def test_every_page_says_that_a_tip_is_retired_or_overdue(
    result: Result, printed: Printed, words: Words
) -> None:
    for page in words(printed(result, status=(RETIRED, OVERDUE))):
        assert {"RETIRED", "OVERDUE"} <= set(page)


def test_the_tip_is_reported_to_the_second_digit_of_its_uncertainty(
    result: Result, stated: dict[str, Any], printed: Printed, words: Words
) -> None:
    lines = [line for page in words(printed(result)) for line in page]
    at = lines.index("Tip / mm")
    reported, within = lines[at + 1 : at + 4], lines[at + 5 : at + 8]

    for i in range(3):
        digits = within[i].replace(".", "").lstrip("0")
        assert len(digits) == 2
        assert len(reported[i].partition(".")[2]) == len(within[i].partition(".")[2])
        decimals = len(reported[i].partition(".")[2])
        assert float(reported[i]) == round(stated["tip_pen_mm"][i], decimals)


def test_certificates_laboratory_and_conditions_are_on_the_report(
    result: Result, printed: Printed, words: Words
) -> None:
    pen = ListedPen(
        id="LP-04", certificate="K-17", certified=date(2026, 3, 1), due=date(2027, 3, 1)
    )
    traced = (
        TracedItem(ItemKind.PEN, "LP-04", pen),
        TracedItem(ItemKind.CONE, "C-1", None),
    )
    calibration = result.calibration
    assumed = replace(
        calibration.assumptions, temperature_c=21.5, humidity_percent=45.0
    )
    result = replace(
        result, calibration=structs.replace(calibration, assumptions=assumed)
    )
    laboratory = Laboratory(
        *("Metrology", "m@example.com", "Berlin", "DE"),
        street="Seestr. 1",
        procedure="WI 7.3",
    )
    pages = words(printed(result, traced=traced, laboratory=laboratory))
    lines = [line for page in pages for line in page]

    at = lines.index("Pen (LED measurement)")
    assert lines[at : at + 5] == [
        lines[at],
        "LP-04",
        "K-17",
        "2026-03-01",
        "2027-03-01",
    ]
    at = lines.index("C-1", at)
    assert lines[at + 1 : at + 4] == 3 * ["not stated"]
    for text in ("Metrology", "Seestr. 1, Berlin, DE", "WI 7.3", "45 %", "21.5 \xb0C"):
        assert text in lines


def test_what_an_auditor_asks_for_is_there(
    doubted: Result, stated: dict[str, Any], printed: Printed, words: Words
) -> None:
    day = datetime(2025, 12, 1, tzinfo=UTC)
    since = TipChange(
        *(day, (0.001, 0.0301, 0.0), (0.002, 0.0142, 0.002)),
        as_found_mm=(1.0, 2.0, 3.0),
        as_found_expanded_uncertainty_mm=(0.001, 0.002, 0.003),
        limit_mm=0.02,
    )
    entered = EntryPlace(chain=32 * "b", number=41, sha256=64 * "a")

    reported = " ".join(
        " ".join(page)
        for page in words(printed(replace(doubted, change=since), entered))
    )

    for text in (
        "Calibration report",
        "not a certificate",
        "relate only to the items named",
        "New ball mounted.",
        "mm). Was the tip replaced, bent or refitted?",
        "Decision rule",
        "simple acceptance (ILAC-G8:09/2019",
        "Uncertainty budget",
        "Change since 2025-12-01 / mm",
        "Tip as found / mm 1.0000 2.0000 3.0000",
        "is 0.030 mm from the tip as left, BEYOND its limit of 0.02 mm",
        "2026-01-02 12:00:00+00:00",
        "3.0005 mm",
        stated["inputs"]["camera"]["sha256"],
        64 * "a",
        32 * "b",
        "58 of 60",
        "1 tip slipped",
        "1 too few LEDs",
        "Calibrated by",
    ):
        assert text in reported, text


def test_each_image_that_was_left_out_is_named_with_its_reason(
    result: Result, printed: Printed, words: Words
) -> None:
    lines = [line for page in words(printed(result)) for line in page]
    at = lines.index("Reason")

    assert lines[at + 1 : at + 4] == ["4", "frame 4", "too few LEDs"]
    assert lines[at + 4 : at + 7] == ["6", "frame 6", "tip slipped"]


@pytest.mark.usefixtures("chinese")
def test_stored_messages_are_printed_in_chinese_from_code_and_values_alone(
    doubted: Result, printed: Printed, words: Words
) -> None:
    drift = StoredMessage.of(message("warning.drift", distance=0.0123))
    why = doubted.why
    assert why is not None
    without_text = replace(
        doubted,
        why=structs.replace(why, text=""),
        doubts=(structs.replace(drift, text=""),),
    )

    reported = "".join("".join(page) for page in words(printed(without_text)))

    for each, number in ((why, "0.0301"), (drift, "0.0123")):
        in_chinese = worded(each)
        assert in_chinese.replace(" ", "") in reported.replace(" ", "")
        assert number in in_chinese
        assert re.search("[\u4e00-\u9fff]", in_chinese)


@pytest.mark.usefixtures("chinese")
def test_in_chinese_no_word_is_left_in_english(
    doubted: Result, printed: Printed, words: Words
) -> None:
    paper = printed(replace(doubted, reason="\u6362\u4e86\u6d4b\u7403"))
    lines = [line for page in words(paper) for line in page]

    kept = {
        *("Hall", "Ann", "LP", "LED", "px", "mm", "rms", "SHA", "JSON", "json"),
        *("lightpen", "GUM", "JCGM", "ILAC", "file", "csv", "frame"),
    }
    left = [
        word
        for line in lines
        for word in re.findall(r"[A-Za-z]{3,}", HASHES.sub("", line))
        if word not in kept
    ]
    assert left == []
    assert "\u6807\u5b9a\u62a5\u544a" in lines


def test_a_character_that_no_font_has_is_reported_by_its_number(
    result: Result, printed: Printed, words: Words
) -> None:
    second_level, unassigned = "\u946b\u65fb", "\u0378"  # of GB 2312; of nobody
    names = replace(result.names, operator=f"{second_level} {unassigned}")

    reported = " ".join(words(printed(replace(result, names=names)))[0])

    assert second_level in reported
    assert "U+0378]" in reported
    assert (
        "[U+...] is the Unicode number of a character missing in the fonts of "
        "this report."
    ) in reported
    plain = " ".join(words(printed(result))[0])
    assert "U+" not in plain


def test_each_camera_of_a_rig_is_among_the_files(
    result: Result, stated: dict[str, Any], printed: Printed, words: Words
) -> None:
    files = stated["inputs"]
    first, second = ({**files["camera"], "file": f"{n}.yaml"} for n in ("a", "b"))
    inputs = {**files, "cameras": [first, second]}
    other = replace(result, calibration=record_of({**stated, "inputs": inputs}))

    reported = " ".join(" ".join(page) for page in words(printed(other)))

    assert "Camera a.yaml" in reported
    assert "Camera b.yaml" in reported


def test_the_pdf_holds_all_that_an_archive_asks_of_it(
    doubted: Result, printed: Printed
) -> None:
    pdf = pdf_of(printed(doubted))

    assert pdf.startswith(b"%PDF-1.4")
    assert b'pdfaid:part="1" pdfaid:conformance="B"' in pdf
    assert b"/GTS_PDFA1" in pdf
    assert len(re.findall(rb"/FontFile2 ", pdf)) == len(
        re.findall(rb"/Type ?/FontDescriptor", pdf)
    )
    assert re.findall(rb"/BaseFont ?/([\w+-]+)", pdf)
    assert all(b"Lightpen" in name for name in re.findall(rb"/FontName ?/(\S+)", pdf))
    # See-through colours are what PDF/A-1 forbids above all.
    assert {*re.findall(rb"/ca ([\d.]+)", pdf)} <= {b"1.0", b"1"}
    assert b"/SMask " not in pdf.replace(b"/SMask /None", b"")
    assert b"CMYK" not in pdf.replace(b"/CSpcmyk", b"").replace(b"/PCSpcmyk", b"")
    assert len(pdf) < 2_000_000
    assert b"<rdf:li>Ann</rdf:li>" in pdf


def test_the_same_file_gives_the_same_pages(
    result: Result, printed: Printed, words: Words, tmp_path: Path
) -> None:
    assert words(printed(result)) == words(printed(result))
    assert [path.name for path in tmp_path.iterdir()] == ["000017.json"]
