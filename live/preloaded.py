"""Imports of a process that gives whole answers, made once before it is forked."""

import elastic.elastodynamics  # noqa: F401
import live.answer  # noqa: F401
