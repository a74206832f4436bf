"""Where the links are: driven links, dyads in closed form, any other group by Newton's method."""

from rigid.positions.link_positions import place
from rigid.positions.rows import select_designs
