"""Weak forms of a body in plane stress for scikit-fem."""

from typing import Any

from skfem import BilinearForm, LinearForm
from skfem.helpers import ddot, div, dot, sym_grad


@BilinearForm
def plane_stress(u: Any, v: Any, given: Any) -> Any:
    """Virtual work of the stresses of u on the strains of v; `membrane` is E t/(1 - nu^2) [N/m], `poisson` is nu."""
    shearing = (1.0 - given.poisson) * ddot(sym_grad(u), sym_grad(v))
    return given.membrane * (shearing + given.poisson * div(u) * div(v))


@LinearForm
def pushed(v: Any, given: Any) -> Any:
    """Virtual work of the force per area `load` [N/m^2] on v."""
    return dot(given.load, v)


@LinearForm
def swollen(v: Any, given: Any) -> Any:
    """Virtual work on v of the stresses `swelling` [N/m] that a restrained isotropic strain causes."""
    return given.swelling * div(v)
