"""Natural frequencies of a mechanism with locked drives."""

from elastic.vibration.frequencies import TOLERANCE, Frequencies, natural_frequencies
from elastic.vibration.link_matrices import elastic_coordinates
