"""Limits on the number of beams for which vibration and buckling are computed."""

from rigid import Mechanism

MAX_FULL_BEAMS = 64  # maximum number of beams that all have the full number of coordinates; needs 1.5 GB, 15 s
MAX_COORDINATES = 18 * MAX_FULL_BEAMS
MAX_BEAMS = 150  # maximum number of beams if some are short pieces of links, which need fewer coordinates
INNER = 4  # initial number of polynomial shape functions along a vibrating beam


def too_many_beams(mechanism: Mechanism) -> str:
    """Return the reason why vibration and buckling are not computed. It is empty if they are computed."""
    count = len(mechanism.beams)
    if count <= MAX_FULL_BEAMS:
        return ""
    from elastic.vibration import elastic_coordinates

    coordinates = {link.name: elastic_coordinates(link, INNER) for link in mechanism.links}
    size = sum(coordinates.values())
    if count <= MAX_BEAMS and size <= MAX_COORDINATES:
        return ""
    link = max(coordinates, key=lambda name: coordinates[name])
    where = f'of which {len(mechanism.links[mechanism.index[link]].beams)} are in the link "{link}"'
    most = f"expected at most {MAX_BEAMS} beams and {MAX_COORDINATES} coordinates"
    return f"vibration and buckling are not computed for {count} beams with {size} coordinates, {where}: {most}"
