"""Cut the bundled fonts from Noto Sans: ``python resources/cut_fonts.py [FOLDER]``.

Needs fonttools, and a folder that holds, at any depth, NotoSans-Regular.ttf,
NotoSansCJK-Regular.ttc and the two in Bold, as Debian's packages fonts-noto-core and
fonts-noto-cjk do. Without a folder, these packages are downloaded with apt-get and
unpacked, but not installed.

The Latin fonts keep the European alphabets; the Chinese ones keep all of GB 2312, in
which names are written, what is frequent in names besides, the characters that the
translations, the help and the reports use, and signs that Noto Sans lacks. Run it
again when a test says that characters are missing.
"""

import subprocess
import sys
import tempfile
from collections.abc import Iterable
from itertools import product
from pathlib import Path

from fontTools import subset
from fontTools.pens.cu2quPen import Cu2QuPen
from fontTools.pens.ttGlyphPen import TTGlyphPen
from fontTools.ttLib import TTCollection, TTFont, newTable

PACKAGE = Path(__file__).parent / "lightpen_resources"
OUTPUT = PACKAGE / "fonts"
DEBIAN_PACKAGES = ("fonts-noto-core", "fonts-noto-cjk")
WEIGHTS = ("Regular", "Bold")
LATIN = [
    *range(0x20, 0x7F),
    *range(0xA0, 0x180),
    *range(0x370, 0x400),
    *range(0x400, 0x460),
    *map(ord, "\u2009\u200b\u2010\u2011\u2012\u2013\u2014\u2018\u2019\u201c\u201d"),
    *map(ord, "\u2026\u2032\u2033\u20ac\u2122\u2212\u2070\u2074"),
    *range(0x2080, 0x2084),
]
SIGNS = "\u2190\u2191\u2192\u2193\u2264\u2265\u2248\u221a\u221e\u2220\u2300"
# In names of people since 1949, though GB 2312 of 1980 lacks them.
NAMES = (
    "喆堃赟翀祎昇珺晞頔犇龑瑀煊璟玙旻昉暐琤峄垚燚淏湉瑄璠翾芃曌彧玥珞珮璎燊铄媞婳妤姝堉"
    "濛骉骁翊玚珩琀瑨瓅甯眭禛祾竑筱纮翃耘莳蓁褀谞赪轶逄邴郗钘鎏闫霁颢飏骐鹍黛昺晗暕"
)
MAX_ERROR = 1.0  # of an outline, in thousandths of the font size
LIMITS_OF_INSTRUCTIONS = (
    "maxTwilightPoints",
    "maxStorage",
    "maxFunctionDefs",
    "maxInstructionDefs",
    "maxStackElements",
    "maxSizeOfInstructions",
)
COPYRIGHT_NOTICE = "Cut from {}, whose copyright notice reads: {}"


def main(folder: str | None = None) -> None:
    """Write the fonts, from a folder or from Debian's packages."""
    with tempfile.TemporaryDirectory() as scratch:
        source = Path(folder) if folder else _download(Path(scratch))
        OUTPUT.mkdir(exist_ok=True)
        for weight in WEIGHTS:
            latin = TTFont(_find(source, f"NotoSans-{weight}.ttf"))
            _cut(latin, LATIN, "Lightpen Sans", weight)
            collection = TTCollection(_find(source, f"NotoSansCJK-{weight}.ttc"))
            chinese = next(
                font for font in collection if _name(font) == "Noto Sans CJK SC"
            )
            _cut(chinese, _characters_wanted(), "Lightpen Sans SC", weight)


def _download(folder: Path) -> Path:
    """Return a folder with the Debian packages unpacked."""
    subprocess.run(["apt-get", "download", *DEBIAN_PACKAGES], cwd=folder, check=True)
    for package in folder.glob("*.deb"):
        subprocess.run(["dpkg-deb", "-x", package, folder], check=True)
    return folder


def _find(folder: Path, name: str) -> Path:
    for path in folder.rglob(name):
        return path
    raise SystemExit(f"{folder} holds no {name}.")


def _name(font: TTFont) -> str | None:
    """Return the family of a font."""
    return str(font["name"].getBestFamilyName())


def _gb2312() -> str:
    """Return the characters of GB 2312, levels 1 and 2, and its signs."""
    first, last = 0xA1, 0xFE
    pairs = product(range(first, last + 1), repeat=2)
    return "".join(bytes(pair).decode("gb2312", "ignore") for pair in pairs)


def _characters_wanted() -> list[int]:
    """Return the characters of names, and all of translations, help and reports."""
    files = [*PACKAGE.glob("translations/*.ts"), *PACKAGE.glob("help/*/*.md")]
    files += PACKAGE.glob("reports/*.txt")
    used = "".join(file.read_text("utf-8") for file in files)
    text = SIGNS + NAMES + _gb2312() + used
    return sorted({ord(character) for character in text if character > "\x7f"})


def _cut(font: TTFont, characters: Iterable[int], family: str, weight: str) -> None:
    """Write the part of a font that draws these characters, under a name of its own.

    The name keeps apart what is bundled and the whole font that a system may have.
    """
    options = subset.Options(
        name_IDs=[0, 1, 2, 3, 4, 5, 6, 13, 14],
        name_languages=[0x409],
        notdef_outline=True,
        hinting=False,
        # No "locl": the glyphs are those of Simplified Chinese anyway, and the forms of
        # other countries would take as much room again.
        layout_features=["kern", "mark", "mkmk", "ccmp"],
        drop_tables=["vhea", "vmtx", "VORG", "DSIG", "BASE"],
    )
    font.recalcTimestamp = False  # the same input gives the same file
    subsetter = subset.Subsetter(options)
    subsetter.populate(unicodes=characters)
    subsetter.subset(font)
    names = font["name"]
    notice = COPYRIGHT_NOTICE.format(_name(font), names.getDebugName(0))
    compact = family.replace(" ", "")
    for number, text in (
        (0, notice),
        (1, family),
        (2, weight),
        (3, f"{compact}-{weight}"),
        (4, f"{family} {weight}"),
        (6, f"{compact}-{weight}"),
    ):
        names.removeNames(nameID=number)
        names.setName(text, number, 3, 1, 0x409)
    if "CFF " in font:
        _to_truetype(font)
    font.save(OUTPUT / f"{compact}-{weight}.ttf")


def _to_truetype(font: TTFont) -> None:
    """Turn cubic outlines into quadratic ones.

    Qt blends cubic (CFF) fonts by another rule than TrueType ones: light on dark, the
    Chinese words would look bold beside the Latin ones.
    """
    glyphs = font.getGlyphSet()
    order = font.getGlyphOrder()
    outlines = {}
    for name in order:
        pen = TTGlyphPen(glyphs)
        glyphs[name].draw(Cu2QuPen(pen, MAX_ERROR, reverse_direction=True))
        outlines[name] = pen.glyph()
    font["loca"] = newTable("loca")
    font["glyf"] = newTable("glyf")
    font["glyf"].glyphOrder = order
    font["glyf"].glyphs = outlines
    maximum = font["maxp"]
    maximum.tableVersion = 0x00010000
    for name in LIMITS_OF_INSTRUCTIONS:
        setattr(maximum, name, 0)
    maximum.maxZones = 1
    maximum.maxComponentElements = 0
    font["post"].formatType = 3.0
    font["post"].glyphOrder = order
    del font["CFF "]
    font.sfntVersion = "\000\001\000\000"


if __name__ == "__main__":
    main(*sys.argv[1:2])
