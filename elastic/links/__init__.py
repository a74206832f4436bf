"""All links under their loads: free bodies, clamped links, compatibility at the joints."""

from elastic.links.added_loads import AddedLoads, map_loads
from elastic.links.beam_trees import lined_up

__all__ = [
    "AddedLoads",
    "lined_up",
    "map_loads",
]


def __dir__() -> list[str]:
    return __all__
