"""Every package defines the names in its __all__."""

import importlib
import inspect
import pkgutil

import numpy as np
import pytest
from mechanisms import steel_four_bar

from rigid import motion, posture, reactions, structure

PACKAGES = ("rigid", "elastic", "symbols", "machine", "fem_check", "animations", "exchange", "kinelast")


@pytest.mark.parametrize("name", PACKAGES)
def test_every_promised_name_is_there(name):
    package = importlib.import_module(name)
    assert sorted(package.__all__) == sorted(set(package.__all__))
    for promised in package.__all__:
        assert not inspect.ismodule(getattr(package, promised))
    assert dir(package) == sorted(package.__all__)
    with pytest.raises(AttributeError):
        getattr(package, "nothing_of_the_kind")  # noqa: B009


ROOMS = ["rigid.analysis", "rigid.decomposition", "rigid.dynamics", "rigid.positions", "rigid.topology"]


@pytest.mark.parametrize("name", ["rigid", *ROOMS])
def test_no_function_hides_the_module_of_its_name(name):
    """`rigid.chunks` is the module `chunks`, not a function of the same name."""
    package = importlib.import_module(name)
    for found in pkgutil.iter_modules(package.__path__, f"{name}."):
        assert importlib.import_module(found.name) is getattr(package, found.name.rpartition(".")[2])


def test_a_result_shows_itself_in_one_line():
    course = motion(steel_four_bar().mechanism, np.linspace(0, 6, 500), 100.0)
    forces = reactions(course)
    for result in (course, posture(course), forces, structure(course.mechanism), course.mechanism):
        assert type(result).__name__ in repr(result)
        assert len(repr(result)) < 100
        assert "\n" not in repr(result)
