"""Every text that a user sees is translated, compiled, and can be drawn."""

import ast
import importlib.util
import re
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from xml.etree import ElementTree

import pytest
from PySide6.QtCore import QCoreApplication
from PySide6.QtGui import QFont, QRawFont
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QFileDialog,
    QLabel,
    QPushButton,
)
from pytestqt.qtbot import QtBot

from lightpen_app.look.languages import LanguageSwitch, own_name
from lightpen_app.look.theme import FAMILIES, font
from lightpen_app.shell.page_area import NoticeBar
from lightpen_resources import RESOURCES, SOURCE_LANGUAGE, languages

ROOT = RESOURCES.parents[1]
APPLICATION = ROOT / "app" / "lightpen_app"
TRANSLATIONS = RESOURCES / "translations"
CHINESE = TRANSLATIONS / "lightpen_zh_CN.ts"
TRANSLATED = sorted(
    {*TRANSLATIONS.glob("*.ts")} - {TRANSLATIONS / f"lightpen_{SOURCE_LANGUAGE}.ts"}
)
HELP_TOPICS = (
    *("start", "camera", "leds", "swing", "review", "verify", "measure", "history"),
)
# Two words, one by itself that begins with a capital, or one beside a value.
WORDS = re.compile(
    r"[A-Za-z]{2}[,.:]? [A-Za-z]{2}|^[A-Z][a-z]{2,}:? ?$|^ [a-z]{3}|[a-z]{3} $"
    r"|\{\} [A-Za-z]{3}|[A-Za-z]{3}:? \{\}"
)
# Words for what the glossary gives another term: intrinsics file, drift reference,
# probed points; in Chinese intrinsics file, certified value, calibration.
OTHER_TERMS = re.compile(
    r"camera files?\b|reference point|\btouches\b"
    "|\u76f8\u673a\u6587\u4ef6|\u68c0\u5b9a|\u6821\u51c6"
)
# Laboratory and certificate keep the names that standards give them.
NAMED_BY_STANDARDS = re.compile(
    "\u6821\u51c6\u5b9e\u9a8c\u5ba4|\u6570\u5b57\u6821\u51c6\u8bc1\u4e66"
)
TRANSLATING = {"tr", "translate", "QT_TRANSLATE_NOOP"}
UNSEEN = {"setObjectName", "TypeVar", "ValueError"}  # whose words no user reads
ENGLISH = ("self_test", "crash.py")  # files, and both languages
NAMES = {
    *("Lightpen", "English", "Fusion", "Lightpen Sans", "Lightpen Sans SC", "Cgk"),
    *("Demo", "Trial", "Trainee"),  # of stations, pens and tips
    *("yyyy-MM-dd hh:mm", "fixed point", "export folder", "under way"),  # for programs
    "without images",  # cause of notifications
}


def load_tool() -> ModuleType:
    path = ROOT / "resources" / "update_translations.py"
    spec = importlib.util.spec_from_file_location("update_translations", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


TOOL = load_tool()


def messages(ts_file: Path) -> Iterator[tuple[str, str, ElementTree.Element]]:
    for context in ElementTree.parse(ts_file).getroot().iter("context"):
        for message in context.iter("message"):
            translation = message.find("translation")
            assert translation is not None
            yield (
                context.findtext("name", ""),
                message.findtext("source", ""),
                translation,
            )


def texts_of(translation: ElementTree.Element) -> list[str]:
    """The translation, or its plural forms."""
    forms = [form.text or "" for form in translation.iter("numerusform")]
    return forms or [translation.text or ""]


def untranslated(ts_file: Path) -> list[str]:
    return [
        f"{context}: {source}"
        for context, source, translation in messages(ts_file)
        if translation.get("type") is not None or not all(texts_of(translation))
    ]


@lru_cache(maxsize=1)
def calls_in(source: str) -> tuple[ast.Call, ...]:
    nodes = ast.walk(ast.parse(source))
    return tuple(node for node in nodes if isinstance(node, ast.Call))


def bare_texts(node: ast.AST) -> Iterator[str]:
    """Words that are not handed to what translates them, wherever they are."""
    match node:
        case ast.Call(func=function) if name_of(function) in TRANSLATING | UNSEEN:
            return
        case ast.Call(func=ast.Attribute(value=ast.Name(id="_logger"))):
            return  # the log is in English
        case ast.Expr(value=ast.Constant()):  # a docstring
            return
        case ast.Constant(value=str() as text):
            if WORDS.search(re.sub("<[^>]*>", "", text)) and text not in NAMES:
                yield text
        case ast.JoinedStr(values=parts):
            literals = [
                part.value if isinstance(part, ast.Constant) else "{}" for part in parts
            ]
            text = re.sub("<[^>]*>", "", "".join(map(str, literals)))
            if WORDS.search(text):
                yield text
            for part in parts:
                if isinstance(part, ast.FormattedValue):
                    yield from bare_texts(part.value)
        case _:
            for field, value in ast.iter_fields(node):
                if field in ("annotation", "returns"):
                    continue
                for child in value if isinstance(value, list) else [value]:
                    if isinstance(child, ast.AST):
                        yield from bare_texts(child)


def name_of(function: ast.expr) -> str:
    return getattr(function, "attr", getattr(function, "id", ""))


def formatted_texts(source: str) -> list[str]:
    """Calls of tr() with an f-string, which lupdate takes word for word."""
    return [
        ast.unparse(node)
        for node in calls_in(source)
        if getattr(node.func, "attr", "") == "tr"
        and any(isinstance(argument, ast.JoinedStr) for argument in node.args)
    ]


def plain_errors(source: str) -> list[str]:
    """Errors that are turned into words without a language."""
    return [
        ast.unparse(node)
        for node in calls_in(source)
        if getattr(node.func, "id", "") == "str"
        and any(ast.unparse(argument) == "error" for argument in node.args)
    ]


@pytest.mark.parametrize("ts_file", TRANSLATED, ids=str)
def test_every_text_is_translated(ts_file: Path, tmp_path: Path) -> None:
    """The texts are collected anew, so that one added since is found as well."""
    fresh = tmp_path / ts_file.name
    fresh.write_bytes(ts_file.read_bytes())

    TOOL.collect(fresh, APPLICATION, TOOL.translated_templates())

    assert untranslated(fresh) == []


@pytest.mark.slow
def test_no_text_reaches_the_screen_untranslatable() -> None:
    for path in APPLICATION.rglob("*.py"):
        source = path.read_text("utf-8")
        if not {path.name, path.parent.name}.intersection(ENGLISH):
            assert list(bare_texts(ast.parse(source))) == [], path.name
        assert formatted_texts(source) == [], path.name
        assert plain_errors(source) == [], path.name


@pytest.mark.parametrize(
    "source",
    [
        "label.setText('Hello')",
        "label.setText('Yes' if is_so else '')",
        "label.setText('Left: ' + side)",
        "label.setText(f'{n} images')",
        "label.setText(f'Images: {n}')",
        "spin.setSuffix(' images')",
        "box.addItem('under the arm')",
        "table.setHorizontalHeaderLabels(['Images'])",
        "WORDS = {Kind.ONE: 'Left out'}",
    ],
)
def test_a_text_that_nothing_translates_is_noticed(source: str) -> None:
    assert len(list(bare_texts(ast.parse(source)))) == 1


@pytest.mark.parametrize("ts_file", sorted(TRANSLATIONS.glob("*.ts")), ids=str)
def test_the_compiled_translations_are_fresh(ts_file: Path, tmp_path: Path) -> None:
    compiled = TOOL.compile_ts(ts_file, tmp_path)

    assert compiled.read_bytes() == ts_file.with_suffix(".qm").read_bytes()


def places_in(text: str) -> list[str]:
    """The places of values in a text, each with its format."""
    return sorted(re.findall(r"\{[^{}]*\}|%n", text))


@pytest.mark.parametrize("ts_file", TRANSLATED, ids=str)
def test_a_translation_keeps_the_places_and_formats_of_the_values(
    ts_file: Path,
) -> None:
    for _, source, translation in messages(ts_file):
        for text in texts_of(translation):
            assert places_in(text) == places_in(source), source


def test_the_language_changes_while_a_widget_is_shown(
    qapp: QApplication, qtbot: QtBot
) -> None:
    notice = NoticeBar()
    qtbot.addWidget(notice)
    (close,) = notice.findChildren(QAbstractButton)
    switch = LanguageSwitch(qapp)

    switch.set_language("zh_CN")
    QCoreApplication.processEvents()
    chinese = close.text()
    switch.set_language(SOURCE_LANGUAGE)
    QCoreApplication.processEvents()

    assert chinese == "\u5173\u95ed"
    assert close.text() == "Close"


def test_texts_of_qt_itself_are_translated_too(qapp: QApplication) -> None:
    switch = LanguageSwitch(qapp)
    switch.set_language("zh_CN")

    assert QCoreApplication.translate("QPlatformTheme", "Cancel") == "\u53d6\u6d88"
    dialog = QFileDialog()
    dialog.setOption(QFileDialog.Option.DontUseNativeDialog)
    shown = [label.text() for label in dialog.findChildren(QLabel)]
    shown += [button.text() for button in dialog.findChildren(QPushButton)]
    assert [text for text in shown if text and text.isascii()] == []
    dialog.deleteLater()


def missing_characters(text: str) -> set[str]:
    fonts = []
    for family in FAMILIES:
        for bold in (False, True):
            one = QFont(font(16, bold=bold))
            one.setFamilies([family])
            fonts.append((bold, QRawFont.fromFont(one)))
    return {
        character
        for character in set(text)
        if character.isprintable()
        for weight in (False, True)
        if not any(
            raw.supportsCharacter(ord(character))
            for bold, raw in fonts
            if bold is weight
        )
    }


def test_the_bundled_fonts_hold_every_character_that_is_shown() -> None:
    files = [
        *TRANSLATIONS.glob("*.ts"),
        *(RESOURCES / "help").rglob("*.md"),
        *(RESOURCES / "reports").glob("*.txt"),
        *APPLICATION.rglob("*.py"),
    ]
    text = "".join(path.read_text("utf-8") for path in files)

    assert missing_characters(text) == set(), "run resources/cut_fonts.py"


@pytest.mark.parametrize("language", languages())
@pytest.mark.parametrize("topic", HELP_TOPICS)
def test_every_step_has_help(language: str, topic: str) -> None:
    text = (RESOURCES / "help" / language / f"{topic}.md").read_text("utf-8")

    assert text.startswith("# ")
    assert len(text) > 100


def test_labels_are_translated_as_in_the_glossary() -> None:
    lines = (RESOURCES / "help" / "en" / "glossary.md").read_text("utf-8").splitlines()
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines[6:]]
    terms = {english: chinese for english, chinese, _, _ in rows[2:]}
    assert len(terms) >= 40
    assert list(terms) == sorted(terms)
    others = {
        f"{source}: {translation.text}"
        for _, source, translation in messages(CHINESE)
        if translation.text != terms.get(source.lower(), translation.text)
    }

    assert others == set()


def other_terms(text: str) -> list[str]:
    return OTHER_TERMS.findall(NAMED_BY_STANDARDS.sub("", text))


def test_texts_use_the_terms_of_the_glossary() -> None:
    for _, source, translation in messages(CHINESE):
        for text in (source, *texts_of(translation)):
            assert other_terms(text) == [], text


@pytest.mark.parametrize("page", sorted((RESOURCES / "help").glob("*/*.md")), ids=str)
def test_a_page_of_the_help_links_only_to_others(page: Path) -> None:
    for link in re.findall(r"\]\(([^)]*)\)", page.read_text("utf-8")):
        assert (RESOURCES / "help" / "en" / Path(link).name).is_file()


def test_the_languages_name_themselves() -> None:
    names = [own_name(language) for language in languages()]

    assert names[0] == "English"
    assert "\u7b80\u4f53\u4e2d\u6587" in names
    assert len(set(names)) == len(names)


def test_a_language_is_there_by_its_file_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for file in TRANSLATIONS.glob("*.qm"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    chinese = tmp_path / "lightpen_zh_CN.qm"
    (tmp_path / "lightpen_de.qm").write_bytes(chinese.read_bytes())
    monkeypatch.setattr("lightpen_resources.TRANSLATIONS", tmp_path)
    monkeypatch.setattr("lightpen_app.look.languages.TRANSLATIONS", tmp_path)

    assert languages() == ("en", "de", "zh_CN")
    assert own_name("de") == own_name("zh_CN")
