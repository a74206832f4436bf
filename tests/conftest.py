"""Random tests draw the same cases on every machine, and as long as they take."""

from hypothesis import settings

settings.register_profile("steady", derandomize=True, deadline=None, database=None)
settings.load_profile("steady")
