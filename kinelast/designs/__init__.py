"""Many designs of a scene at once: numbers of the file by their paths, and the figures of every design."""

from kinelast.designs.evaluate import Designs, evaluate
from kinelast.scene.variables import Variable

__all__ = ["Designs", "Variable", "evaluate"]


def __dir__() -> list[str]:
    return __all__
