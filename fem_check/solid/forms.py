"""Weak forms of a body in plane stress for scikit-fem."""

from typing import Any

from skfem import BilinearForm, LinearForm
from skfem.helpers import ddot, div, dot, sym_grad


@BilinearForm
def plane_stress(u: Any, v: Any, given: Any) -> Any:
    """Virtual work of stresses of u on strains of v; `membrane` E t/(1 - nu^2) [N/m], `poisson` nu."""
    shearing = (1.0 - given.poisson) * ddot(sym_grad(u), sym_grad(v))
    return given.membrane * (shearing + given.poisson * div(u) * div(v))


@LinearForm
def pushed(v: Any, given: Any) -> Any:
    """Virtual work of a force per area, `load` [N/m^2], on v."""
    return dot(given.load, v)


@LinearForm
def swollen(v: Any, given: Any) -> Any:
    """Virtual work of the stresses of a restrained isotropic strain, `swelling` [N/m]."""
    return given.swelling * div(v)
