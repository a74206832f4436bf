"""Output files of a scene: tables, pages and pictures. A failed run leaves the result folder unchanged."""
