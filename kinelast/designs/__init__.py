"""Evaluation of many designs of a scene at once: from numbers, given by path, to figures."""

from kinelast.designs.evaluate import Designs, evaluate
from kinelast.scene.variables import Variable
