"""Many designs of a scene at once: numbers by their paths in, figures out."""

from kinelast.designs.evaluate import Designs, evaluate
from kinelast.scene.variables import Variable
