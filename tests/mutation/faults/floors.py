# SPDX-License-Identifier: Apache-2.0
"""Floors and stairs from Gaussians: what levels a flight and the floors it leads to."""
from . import fault

TEST = "tests/nav/test_gaussian_floor.cpp"
CASE = "gaussian floor: stairs are a ramp*"
MORE = ("src/nav/gaussian_floor.cpp", "src/nav/storeys.cpp", "src/nav/floor_marks.cpp",
        "src/nav/stairs.cpp")

FAULTS = [
    fault("ramp_of_the_flight_alone", "kStairHead", "kStairHead = 1.0;", "kStairHead = 0.0;", TEST, CASE, more=MORE,
          why="treads near a floor's height belong to the floor and stay steps"),
    fault("risers_left_standing", "level_ramps", "if (label_[run] < 0 && g_.runs[run].top() > height_[run] + s_.climb)",
          "if (label_[run] < 0)", TEST, CASE, more=MORE,
          why="a riser between two treads of a floor blocks the flight"),
    fault("gaps_filled_over_stairs", "find", "if (ramp_[r] == kNoLevel || !same) continue;", "continue;", TEST, CASE,
          more=MORE,
          why="a floor's own level above a tread closes the flight"),
    fault("steps_of_two_climbs", "each_neighbour", "max(other, top) - min(other, top) <= s_.climb) f(n, r);",
          "max(other, top) - min(other, top) <= 2 * s_.climb) f(n, r);", TEST, "gaussian floor: steps above*",
          more=MORE, why="steps above the agent's climb lead nowhere"),
    fault("open_storeys_dropped", "find", "indoors && s.inside && s.roofed[i] == 0 && !stairs",
          "indoors && s.roofed[i] == 0",
          TEST, "gaussian floor: an open storey*", more=MORE,
          why="a terrace, or the upper floor of a scan without its roof, is no floor"),
]
