"""Imports of a process that gives whole answers, made once before it is forked."""

import elastic.elastodynamics  # noqa: F401
import kinelast.figures.summary
import kinelast.figures.theory
import kinelast.outputs.page
import kinelast.runs.compute
import kinelast.runs.line  # noqa: F401
import live.answer  # noqa: F401
