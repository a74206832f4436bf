"""Many designs of a scene, computed in one call: results (figures) such as the mass, for given input values."""

from kinelast.designs.evaluate import Designs, evaluate
from kinelast.scene.variables import Variable
