"""Processes, threads, signals and progress: how work is shared out, stopped and told of."""
