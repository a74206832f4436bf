"""Many designs of a scene at once: numbers by their paths in, figures out."""

from kinelast.designs.evaluate import Designs, evaluate
from kinelast.scene.variables import Variable

__all__ = ["Designs", "Variable", "evaluate"]


def __dir__() -> list[str]:
    return __all__
