"""Elastic links under load: free-body equilibrium, clamped links, and compatibility at the joints."""

from elastic.links.added_loads import AddedLoads, map_loads
from elastic.links.beam_trees import MAX_OFFSET, acting_points, in_line, lined_up
from elastic.links.members import BeamRun, BeamRuns, members_of, spans_of
