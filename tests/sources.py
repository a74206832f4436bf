"""Helpers for the tests of the source documents."""

import numpy as np
from second_routes import multiplier_forces, virtual_work_efforts

from kinelast.scene.document import read_scene
from kinelast.tasks.task import shipped_scenes
from rigid import drive_efforts, reactions


def shipped(name):
    return read_scene(shipped_scenes()[name])


def number(course, link):
    return course.mechanism.index[link]


def three_ways(course):
    """Return the effort of the first drive by Newton-Euler, virtual work and multipliers, shape (3, positions)."""
    newton = drive_efforts(course, reactions(course))[0]
    return np.array([newton, virtual_work_efforts(course)[0], drive_efforts(course, multiplier_forces(course))[0]])
