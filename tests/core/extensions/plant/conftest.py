"""Stations as in the tests of main's archive, and a server for them."""

from tests.core.archive.conftest import *  # noqa: F403 - the same fixtures
