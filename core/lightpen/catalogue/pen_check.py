"""Messages of pen check: code, then template with named values."""

MESSAGES = {
    "draft.cell": "LED {led}, {column}: {flaw}",
    "draft.normal-length": "LED {led}: the normal {normal} does not have the length 1. Correct it; a disc that faces +z has the normal 0 0 1.",
    "draft.diameter": "Diameter of the discs: {flaw}",
    "draft.disc-diameter": "LED disc diameter {diameter:g} mm is not valid. Give a diameter of up to {most:g} mm.",
    "draft.nominal-tip": "Nominal tip, {axis}: {flaw}",
}
