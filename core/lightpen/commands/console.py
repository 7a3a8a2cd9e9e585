"""Console output of commands: text, progress, and failures to print."""

import argparse
import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import wraps
from pathlib import Path
from time import monotonic
from typing import Any, TypeAlias

from msgspec import Struct

from lightpen.errors import UsageError
from lightpen.formats.files import A_FILE, unreadable, write_whole
from lightpen.formats.images import ImageSource, find_images
from lightpen.formats.observation_files import Centers, read_centers
from lightpen.formats.own_json import record_bytes
from lightpen.messages import Message, printable
from lightpen.model.pen import Pen

DONE, NO_TIP, BAD_INPUT, TO_REPEAT, TO_CHECK, NOT_THE_TIP = 0, 1, 2, 3, 4, 5
LINE_INTERVAL = 15.0  # s, of lines of progress
BAR_WIDTH = 72  # characters

Command: TypeAlias = Callable[[argparse.Namespace], int]


def shown(text: str) -> str:
    """Return a text with control characters of file names escaped."""
    return "\n".join(map(printable, text.split("\n")))


def printing(command: Callable[[argparse.Namespace], int | None]) -> Command:
    """Give a command an exit status also where its output cannot be written.

    A command that returns none is done.
    """

    @wraps(command)
    def run(options: argparse.Namespace) -> int:
        try:
            status = command(options)
            if sys.stdout is not None:
                sys.stdout.flush()
        except BrokenPipeError:  # its reader has seen enough
            _drop_output()
            return DONE
        except OSError as error:
            if error.filename is not None:
                raise unreadable(Path(error.filename), A_FILE, error) from error
            _drop_output()
            print(
                f"lightpen: The result cannot be printed: {error.strerror}. Free some "
                "space, or print it elsewhere.",
                file=sys.stderr,
            )
            return BAD_INPUT
        return DONE if status is None else status

    return run


def require_other_file(record: Path | None, *inputs: Path | None) -> None:
    """Refuse to write the record over one of the files that it is made from."""
    if record is None:
        return
    for path in inputs:
        if path is not None and are_same(path, record):
            raise UsageError("cli.json-over-input", record=record)


def write_record(path: Path, record: Mapping[str, Any] | Struct) -> None:
    """Write a record as JSON with a checksum."""
    write_whole(path, record_bytes(record))


def lacking(option: str) -> UsageError:
    """Return the error that an option is missing that only a record makes optional."""
    return UsageError("cli.option-missing", option=option)


def are_same(one: Path, other: Path) -> bool:
    """Return whether two paths lead to one file."""
    with suppress(OSError):  # one of them is not there, or is not accessible
        return one.samefile(other)
    return os.path.realpath(one) == os.path.realpath(other)


def note(remark: Message) -> None:
    """Print a remark beside the result."""
    print(shown(f"lightpen: {remark}"), file=sys.stderr)


def images_at(*places: str) -> ImageSource:
    """Find images as `find_images`, and print what is to be said of their files."""
    source = find_images(*places)
    remark = source.remark()
    if remark is not None:
        note(remark)
    return source


def centers_at(path: Path, pen: Pen) -> Centers:
    """Read LED centres, and print how many LEDs the file lists as not seen."""
    centers = read_centers(path, pen.n_leds)
    if centers.remark is not None:
        print(shown(str(centers.remark)) + "\n")
    return centers


@contextmanager
def progress(title: str) -> Iterator[Callable[[float], None]]:
    """Show a progress bar on a terminal, and elsewhere a line now and then."""
    if not sys.stderr.isatty():
        reported = monotonic()

        def report(fraction: float) -> None:
            nonlocal reported
            if monotonic() - reported > LINE_INTERVAL and sys.stderr is not None:
                reported = monotonic()
                print(f"{title}: {fraction:.0%}", file=sys.stderr, flush=True)

        yield report
        return
    from tqdm import tqdm

    layout = "{desc} {bar} {percentage:3.0f}%"
    with tqdm(total=1.0, desc=title, bar_format=layout, ncols=BAR_WIDTH) as bar:

        def report(fraction: float) -> None:
            bar.update(fraction - bar.n)

        yield report


def _drop_output() -> None:
    """Discard unprinted output, so that the program does not fail again at its end."""
    if sys.stdout is not None:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
