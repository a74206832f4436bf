"""Weak forms of a body in plane stress for scikit-fem."""

from typing import Any

from skfem import BilinearForm, LinearForm
from skfem.helpers import ddot, div, dot, sym_grad


@BilinearForm
def plane_stress(u: Any, v: Any, given: Any) -> Any:
    """Virtual work of the stresses due to u on the strains of v.

    `membrane` is E t/(1 - nu^2) [N/m], with the thickness t. `poisson` is Poisson's ratio nu.
    """
    shearing = (1.0 - given.poisson) * ddot(sym_grad(u), sym_grad(v))
    return given.membrane * (shearing + given.poisson * div(u) * div(v))


@LinearForm
def pushed(v: Any, given: Any) -> Any:
    """Virtual work of the force per area `load` [N/m^2] on v."""
    return dot(given.load, v)


@LinearForm
def free_strain(v: Any, given: Any) -> Any:
    """Virtual work of a free strain on v.

    `stress` is the stress times the thickness [N/m] that would prevent this strain.
    """
    return given.stress * div(v)
