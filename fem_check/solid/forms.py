"""Weak forms of a body in plane stress, in scikit-fem's terms."""

from __future__ import annotations

from typing import Any

from skfem import BilinearForm, LinearForm
from skfem.helpers import ddot, div, dot, sym_grad


@BilinearForm
def plane_stress(u: Any, v: Any, given: Any) -> Any:
    """Work of the stresses of u on the strains of v; `membrane` is E t/(1 - nu^2) [N/m], `poisson` is nu."""
    shearing = (1.0 - given.poisson) * ddot(sym_grad(u), sym_grad(v))
    return given.membrane * (shearing + given.poisson * div(u) * div(v))


@LinearForm
def pushed(v: Any, given: Any) -> Any:
    """Work of a force per area, `load` [N/m^2], on v."""
    return dot(given.load, v)


@LinearForm
def swollen(v: Any, given: Any) -> Any:
    """Work on v of the stresses that hold back a free strain alike in all directions, `swelling` [N/m]."""
    return given.swelling * div(v)
