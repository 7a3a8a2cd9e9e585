"""Extensions of the program, one package each; they lean on `lightpen` alone."""

from pathlib import Path

from lightpen.messages import add_messages

add_messages(Path(__file__).with_name("messages.json"))
