"""The least that a page can be: a step before or after the one that is tested."""

from typing_extensions import override

from lightpen_app.widgets.page import MainAction, Page


class BlankPage(Page):
    """A step that is complete, with nothing on it."""

    def __init__(self, key: str) -> None:
        super().__init__()
        self.key = key

    @override
    def title(self) -> str:
        return self.key

    @override
    def is_complete(self) -> bool:
        return True

    @override
    def main_action(self) -> MainAction:
        return MainAction("Next")
