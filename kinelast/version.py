"""The version of the program, as a wheel bears it too."""

VERSION = "0.1.0"
