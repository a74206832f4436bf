"""The report on a scene: limits and their verdict, findings on how far the results can be trusted, sections."""
