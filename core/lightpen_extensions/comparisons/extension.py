"""What this extension adds to the program."""

from lightpen.extension import Extension, Subcommand

COMPARISONS = Extension(
    "comparisons",
    commands=(
        Subcommand(
            "repeatability",
            "compare calibrations of one tip",
            "lightpen_extensions.comparisons.commands.repeatability:add_repeatability",
        ),
        Subcommand(
            "recalculate",
            "recompute calibrations and check U by Monte Carlo",
            "lightpen_extensions.comparisons.commands.recalculate:add_recalculate",
        ),
    ),
)
