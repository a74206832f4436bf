"""SVG drawings of a mechanism at full size: links with holes at their joints, and paths of points."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType
from xml.sax.saxutils import escape, quoteattr

from exchange.dxf import AXIS, FIXED, DrawnLink

MARGIN = 0.02  # (width of the margin) / (size of the drawing)
At = Callable[[complex], str]  # function that converts a position to coordinates in the SVG file
HEAD = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"'


def svg_text(
    links: Iterable[DrawnLink],
    fixed: Mapping[str, complex],
    paths: Mapping[str, Sequence[complex]],
    unit: str,
    curves: Mapping[str, Sequence[complex]] = MappingProxyType({}),
) -> str:
    """Return an SVG drawing with the same layers as a drawing from `dxf_text`. In print, the drawing has full size.

    Parameters
    ----------
    fixed
        Position of each point of the ground, by point name.
    paths
        Successive positions of moving points, by name.
    unit
        Unit of all lengths: "mm", "cm" or "in".
    curves
        Corners of closed curves, by layer name.
    """
    links = list(links)
    ends = [
        place + corner * max(first, last, 0.0)
        for link in links
        for start, end, first, last in link.beams
        for place in (start, end)
        for corner in (1 + 1j, -1 - 1j)
    ]
    places = [*ends, *fixed.values(), *(each for path in (*paths.values(), *curves.values()) for each in path)]
    places += [each for link in links for each in link.points.values()]
    known = [each for each in places if abs(each) < float("inf")] or [0j]
    (left, right), (low, high) = (
        (min(part), max(part)) for part in zip(*((z.real, z.imag) for z in known), strict=True)
    )
    room = MARGIN * max(right - left, high - low) + 2 * FIXED
    width, height = right - left + 2 * room, high - low + 2 * room
    line = max(width, height) / 1000

    def at(place: complex) -> str:
        return f"{place.real - left + room:.9g},{high + room - place.imag:.9g}"

    layers = [_layer(link.name, _link(link, at, line)) for link in links]
    layers += [
        _layer(AXIS + link.name, [_polyline(link.points.values(), at)]) for link in links if len(link.points) > 1
    ]
    layers.append(_layer("ground", [_circle(place, FIXED, at) for place in fixed.values()]))
    layers += [_layer(f"path {name}", [_polyline(path, at)]) for name, path in paths.items()]
    layers += [_layer(name, [_polyline(curve, at, "polygon")]) for name, curve in curves.items()]
    size = f'width="{width:.9g}{unit}" height="{height:.9g}{unit}" viewBox="0 0 {width:.9g} {height:.9g}"'
    body = "\n".join(layers)
    return f'{HEAD} {size} fill="none" stroke="black" stroke-width="{line:.3g}">\n{body}\n</svg>\n'


def _layer(name: str, marks: Iterable[str]) -> str:
    label = quoteattr(name)
    return f'<g inkscape:groupmode="layer" inkscape:label={label}><title>{escape(name)}</title>{"".join(marks)}</g>'


def _link(link: DrawnLink, at: At, line: float) -> list[str]:
    """Return SVG elements: the outlines and holes of a link, and a dot for each hole of unknown diameter."""
    marks = []
    for corners in link.outlines():
        one, two, three, four = map(at, corners)
        last, first = (f"{abs(corners[k] - corners[3 - k]) / 2:.9g}" for k in (1, 0))
        marks.append(f'<path d="M{one}L{two}A{last},{last} 0 0 1 {three}L{four}A{first},{first} 0 0 1 {one}Z"/>')
    return marks + [_circle(place, link.holes.get(name, line) / 2, at) for name, place in link.points.items()]


def _circle(place: complex, radius: float, at: At) -> str:
    x, y = at(place).split(",")
    return f'<circle cx="{x}" cy="{y}" r="{radius:.9g}"/>'


def _polyline(places: Iterable[complex], at: At, kind: str = "polyline") -> str:
    return f'<{kind} points="{" ".join(map(at, places))}"/>'
