"""Every package gives what its root promises, and its root promises what it has."""

import importlib
import inspect

import pytest


@pytest.mark.parametrize("name", ["rigid", "elastic", "fem_check", "animations", "kinelast"])
def test_every_promised_name_is_there(name):
    package = importlib.import_module(name)
    assert sorted(package.__all__) == sorted(set(package.__all__))
    for promised in package.__all__:
        assert not inspect.ismodule(getattr(package, promised))
    assert set(package.__all__) <= set(dir(package))
    with pytest.raises(AttributeError):
        getattr(package, "nothing_of_the_kind")  # noqa: B009
