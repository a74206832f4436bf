"""Natural frequencies of a mechanism with its drives locked."""

from elastic.vibration.frequencies import Frequencies, natural_frequencies
from elastic.vibration.link_matrices import elastic_coordinates
