"""``lightpen board``: a board to be printed."""

import argparse
from pathlib import Path

from lightpen.commands.console import printing, shown
from lightpen.errors import UsageError
from lightpen.formats.files import write_whole
from lightpen.intrinsics.boards import parse_board
from lightpen.intrinsics.page import PAPERS, board_page
from lightpen.messages import printable


def add_board(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen board``."""
    parser.set_defaults(run=_board)
    parser.add_argument(
        "board",
        metavar="BOARD",
        help="board, for example chessboard:11x8:20, as for intrinsics",
    )
    parser.add_argument("out", type=Path, metavar="OUT.pdf", help="file to write")
    parser.add_argument(
        "--paper",
        choices=PAPERS,
        help="paper size (default: the smallest that holds the board)",
    )


@printing
def _board(options: argparse.Namespace) -> None:
    if options.out.suffix.lower() != ".pdf":
        raise UsageError("cli.board-suffix", name=printable(options.out.name))
    board = parse_board(options.board)
    write_whole(options.out, board_page(board, options.paper))
    print(
        shown(
            f"The board {board.name} is in {options.out}. Print it at 100 %, not to "
            "fit the page; its scale must be 100 mm long. Mount it on a flat plate."
        )
    )
