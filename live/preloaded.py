"""Imports for the processes that compute full answers, executed once before forking."""

import elastic.elastodynamics  # noqa: F401
import live.answer  # noqa: F401
