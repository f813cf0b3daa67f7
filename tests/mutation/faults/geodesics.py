# SPDX-License-Identifier: Apache-2.0
"""Shortest ways over unfolded faces: which windows a search may leave out."""
from . import fault

SEARCH = "src/nav/geodesic_search.cpp"
TEST = "tests/nav/test_geodesic_windows.cpp"
CASE = "windows: never longer than over points on the edges*"
MORE = (SEARCH, "src/nav/geodesic_straight.cpp", "src/nav/unfolded_mesh.cpp", "src/nav/poly_sheets.cpp",
        "src/nav/face_grid.cpp", "src/nav/face_views.cpp", "src/nav/landmarks.cpp", "src/nav/corridor.cpp")
LANDMARKS = "landmarks: bounds are none too high*"

FAULTS = [
    fault("cone_of_half_a_turn", "spread", " || (wide && right_p > 0 && k + 1 == first + count)", "", TEST,
          CASE, more=MORE, why="from a point on an edge rounding drops the last edge of the face"),
    fault("window_by_its_near_end", "open",
          "dr + length(left - here.at) + kRounding < g + length(left - root)",
          "dr + length(right - here.at) + kRounding < g + length(right - root)", TEST, CASE, more=MORE,
          why="a way from the edge's corner has to be shorter for all of the window"),
    fault("closed_corner_on_one_side", "spread_vertex", "in + v.total - kPi + kRounding);\n  } else",
          "in + kPi + kRounding);\n  } else", TEST, CASE, more=MORE,
          why="a path may bend to either side of a corner that is more than a full turn"),
    fault("landmark_lines_without_error", "most_below", "const double from = max(r->low - kRounding, low), to",
          "if (slope < 2) continue;\n    const double from = max(r->low - kRounding, low), to", TEST,
          LANDMARKS, more=MORE, why="between points that are kept a distance can be below the line"),
    fault("goal_by_its_least_distance", "LandmarkLead", "behind ? -to.high : to.low", "behind ? -to.low : to.high",
          TEST, LANDMARKS, more=MORE, why="what is not known of the goal's distance is on the wrong side"),
    fault("corridor_around_the_inside", "straightened", "sum += length(left - apex);\n",
          "sum += 0 * length(left - apex);\n", TEST, LANDMARKS, more=MORE,
          why="a way that bends is as long as all of its parts"),
]
