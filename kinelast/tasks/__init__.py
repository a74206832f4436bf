"""Requests, tasks and outcomes: the questions put to scenes, the scenes, and their answers in a line."""
