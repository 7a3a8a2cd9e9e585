"""Messages of the command line; English only: code, then template with named values."""

MESSAGES = {
    "application.no-simulator": "The demo needs the extension that simulates a pen. Install all extensions.",
    "application.no-display": "No display is available for the window. Start the program in a desktop session, or use a command; lightpen --help lists them.",
    "log.no-such-level": "{variable} is {found}, which is not a log level. Set it to one of: {levels}.",
    "cli.no-such-file": "The file {path} does not exist. Check the name and the folder.",
    "cli.rig-needed": "Several cameras need --rig FILE instead of --camera.",
    "cli.one-of-each-camera": "The rig has {n_cameras} cameras. Give one folder or file per camera, in the order of the rig file ({names}); put patterns in quotation marks.",
    "cli.images-or-centers": "Give either IMAGES, --centers FILE.csv or --from-record FILE.",
    "cli.record-brings-its-own": "{folder} is the record of a swing and contains these files. Omit {options}.",
    "record.images-unacknowledged": "{n_images} images, the first {first}, are in the folder but not in the journal; their recording was not confirmed, and they are excluded.",
    "cli.rig-and-camera": "The rig file states the files of its cameras. Omit --camera.",
    "rig.paired-by-order": "The image names do not show which images are simultaneous: they are paired in order.",
    "cli.other-number": "Folders or files given: {n_given}. {why}",
    "cli.place-twice": "A folder or file is given twice. {why}",
    "cli.option-missing": "{option} FILE is missing. It may be omitted only for the record of a swing.",
    "cli.json-over-input": "--json {record} would replace the input file of that name. Give the record another name.",
    "cli.window-needs-camera": "--binning and --roi tell how the images differ from those of a camera file. Give it by --camera.",
    "cli.window-written": "The camera file for these images is {file}. It can be given without --binning and --roi.",
    "cli.pen-over-raw": "{out} would replace its input, the measured LEDs. Give the LED file another name.",
}
