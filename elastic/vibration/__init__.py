"""Natural frequencies of a mechanism with held drives."""

from elastic.vibration.frequencies import Frequencies, natural_frequencies
from elastic.vibration.link_matrices import elastic_coordinates
