"""Output files of a scene: tables, pages and pictures, written to a folder that is complete or unchanged."""
