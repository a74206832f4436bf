"""The files of a scene: tables, pages and pictures, and the folder in which they appear all at once."""
