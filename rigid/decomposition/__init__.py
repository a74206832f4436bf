"""Decomposition of a mechanism into groups of links, in the order in which their positions are computed."""

from rigid.decomposition.assur import AssurGroup, assur_groups
from rigid.decomposition.groups import Group, Structure
from rigid.decomposition.order import structure
