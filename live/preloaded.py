"""Imports for processes of full answers, executed once before forking."""

import elastic.elastodynamics  # noqa: F401
import live.answer  # noqa: F401
