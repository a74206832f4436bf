"""Weak forms of beams for scikit-fem."""

from typing import Any

from skfem import BilinearForm, LinearForm
from skfem.helpers import dd, ddot, dot, grad


@BilinearForm
def bending(w: Any, v: Any, given: Any) -> Any:
    """Virtual work of the bending moments due to w on the curvatures of v; `rigidity` is EI."""
    return given.rigidity * ddot(dd(w), dd(v))


@BilinearForm
def stretching(u: Any, v: Any, given: Any) -> Any:
    """Virtual work of the axial forces due to u on the strains of v (`rigidity` is EA).

    For shear forces and shear strains, `rigidity` is kGA.
    """
    return given.rigidity * dot(grad(u), grad(v))


@LinearForm
def pushed(v: Any, given: Any) -> Any:
    """Virtual work of the force per length `load` on v."""
    return given.load * v


@LinearForm
def twisted(v: Any, given: Any) -> Any:
    """Virtual work of the moment per unit length `load` on the slope of v."""
    return given.load * grad(v)[0]
