"""Messages of measuring: code, then template with named values."""

MESSAGES = {
    "measuring.point": "point",
    "measuring.line": "line",
    "measuring.plane": "plane",
    "measuring.circle": "circle",
    "measuring.slot": "slot",
    "measuring.sphere": "sphere",
    "measuring.cylinder": "cylinder",
    "measuring.cone": "cone",
    "measuring.minimum-zone": "minimum zone",
    "measuring.inscribed": "maximum inscribed feature",
    "measuring.circumscribed": "minimum circumscribed feature",
    "measuring.too-few": "{n_points} points do not determine a {kind}; at least {needed} are needed. Probe more points.",
    "measuring.undetermined": "The points do not determine a {kind}. Distribute them over more of its surface.",
    "measuring.no-criterion": "The criterion {criterion} is not defined for a {kind}. Use least squares.",
    "measuring.datums-parallel": "The line of the alignment is perpendicular to its plane and defines no direction in it. Choose another line.",
    "measuring.few-datums": "{n_points} datum points are given; an alignment needs at least {needed}, each with its nominal position.",
    "measuring.datums-on-line": "The datum points are on one line, which leaves the rotation about it undetermined. Add a point beside that line.",
}
