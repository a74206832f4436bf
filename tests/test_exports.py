"""Every package gives what its root promises, and its root promises what it has."""

import importlib

import pytest


@pytest.mark.parametrize("name", ["rigid", "elastic", "fem_check", "animations", "kinelast"])
def test_every_promised_name_is_there(name):
    package = importlib.import_module(name)
    assert sorted(package.__all__) == sorted(set(package.__all__))
    for promised in package.__all__:
        assert getattr(package, promised) is not None
    with pytest.raises(AttributeError):
        package.nothing_of_the_kind
