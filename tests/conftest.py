"""Random tests draw the same cases on every machine, and as long as they take; one browser serves all pages."""

import one_thread  # noqa: F401 - before numpy
import pytest
from browser import started
from hypothesis import settings

settings.register_profile("steady", derandomize=True, deadline=None, database=None)
settings.load_profile("steady")


@pytest.fixture(scope="session")
def driver():
    """A headless Chromium; the test is skipped where there is none."""
    opened = started()
    yield opened
    opened.quit()
