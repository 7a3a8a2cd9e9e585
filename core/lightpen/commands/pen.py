"""``lightpen pen``: transform measured LEDs into the pen frame."""

import argparse
from pathlib import Path

from lightpen.commands.arguments import add_file, add_pen_options
from lightpen.commands.console import are_same, printing, shown
from lightpen.errors import UsageError
from lightpen.formats.pen_files import read_raw_pen, write_pen


def add_pen(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen pen``."""
    parser.set_defaults(run=_pen)
    add_file(parser, "raw", "RAW.csv", "LED coordinates as measured")
    parser.add_argument("out", type=Path, metavar="OUT.csv", help="LED file to write")
    add_pen_options(parser)


@printing
def _pen(options: argparse.Namespace) -> None:
    if are_same(options.raw, options.out):
        raise UsageError("cli.pen-over-raw", out=options.out)
    raw = read_raw_pen(options.raw, options.units, options.led_diameter)
    write_pen(raw, options.out)
    print(shown(f"{raw.n_leds} LEDs in the pen frame are in {options.out}."))
