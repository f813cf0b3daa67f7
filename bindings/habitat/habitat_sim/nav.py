# SPDX-License-Identifier: Apache-2.0
"""Paths, steps and maps on a NavMesh, with the names of Habitat-Sim.

Points are sequences of three numbers, metres, Y up. Points that are returned are magnum.Vector3.
Distances are the shortest on the surface, where Detour's are somewhat longer.
"""

import enum
import functools
import math
from typing import Any, Iterable

import numpy as np

import gsnav_habitat as _shared
from magnum import Vector3

from . import _engine
from ._follower import GreedyGeodesicFollower

_REACH = [2.0, 4.0, 2.0]  # Metres within which a point snaps to the surface.
_NAN = float("nan")


class NavMeshSettings:
    """Settings of a NavMesh that is built. Lengths in metres."""

    _DEFAULTS: dict[str, Any] = {
        "cell_size": 0.05,
        "cell_height": 0.2,
        "agent_height": 1.5,
        "agent_radius": 0.1,
        "agent_max_climb": 0.2,
        "agent_max_slope": 45.0,
        "filter_low_hanging_obstacles": True,
        "filter_ledge_spans": True,
        "filter_walkable_low_height_spans": True,
        "region_min_size": 20.0,
        "region_merge_size": 20.0,
        "edge_max_len": 12.0,
        "edge_max_error": 1.3,
        "verts_per_poly": 6.0,
        "detail_sample_dist": 6.0,
        "detail_sample_max_error": 1.0,
        "include_static_objects": False,
    }

    def __init__(self) -> None:
        self.set_defaults()

    def set_defaults(self) -> None:
        """Sets all fields to their defaults."""
        self.__dict__.update(self._DEFAULTS)

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in self._DEFAULTS:
            raise _shared.NotServed(_shared.message(f"habitat_sim.nav.NavMeshSettings has no field {name!r}"))
        self.__dict__[name] = type(self._DEFAULTS[name])(value)

    def __getattr__(self, name: str) -> Any:
        if name[0] == "_":
            raise AttributeError(f"NavMeshSettings has no attribute {name!r}")
        raise _shared.NotServed(_shared.message(f"habitat_sim.nav.NavMeshSettings.{name}"))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, NavMeshSettings):
            return NotImplemented
        return all(np.float32(getattr(self, name)) == np.float32(getattr(other, name)) for name in self._DEFAULTS)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"NavMeshSettings({', '.join(f'{k}={v!r}' for k, v in self.__dict__.items())})"

    def write_to_json(self, path: str) -> None:
        """Writes the fields to a file."""
        import json  # Here and below: worker processes import this module anew and seldom need it.

        with open(path, "w", encoding="utf-8") as file:
            json.dump(self.__dict__, file, indent=2)

    def read_from_json(self, path: str) -> None:
        """Reads the fields of a file. Raises ValueError naming the file and a field that is unknown."""
        import json

        with open(path, encoding="utf-8") as file:
            values = json.load(file)
        for name, value in values.items():
            if name not in self._DEFAULTS:
                raise ValueError(f"{path}: NavMeshSettings has no field {name!r}")
            setattr(self, name, value)

    def _native(self) -> Any:
        """The same settings as gsnav.NavMeshSettings. Scenes have no objects, so include_static_objects has no
        effect. Raises TypeError for another object."""
        if not isinstance(self, NavMeshSettings):
            raise TypeError(f"navmesh_settings = {self!r}: must be a habitat_sim.NavMeshSettings")
        values = {**self.__dict__, "verts_per_poly": int(self.verts_per_poly)}
        return _engine.library().NavMeshSettings(**values)

    @classmethod
    def _of(cls, native: Any) -> "NavMeshSettings":
        made = cls()
        for name in cls._DEFAULTS:
            setattr(made, name, getattr(native, name))
        return made


class HitRecord(_shared.FullySealed):
    """The nearest point of a wall: `hit_pos`, `hit_normal` (into the free space) and `hit_dist` in metres."""

    def __init__(self, hit_pos: Any = (0, 0, 0), hit_normal: Any = (0, 0, 0), hit_dist: float = 0.0) -> None:
        self.hit_pos, self.hit_normal, self.hit_dist = Vector3(hit_pos), Vector3(hit_normal), hit_dist


class GreedyFollowerCodes(enum.IntEnum):
    """Answers of a follower."""

    ERROR = -2
    STOP = -1
    FORWARD = 0
    LEFT = 1
    RIGHT = 2


class _Path(_shared.FullySealed):
    """Common part of the path requests. `find_path` fills `points` and `geodesic_distance` (metres)."""

    def __init__(self) -> None:
        self.requested_start: Any = Vector3()
        self.points: list[Vector3] = []
        self.geodesic_distance = 0.0

    def _clear(self) -> None:
        self.points, self.geodesic_distance = [], math.inf


class ShortestPath(_Path):
    """Request for a path from `requested_start` to `requested_end`."""

    def __init__(self) -> None:
        super().__init__()
        self.requested_end: Any = Vector3()


class MultiGoalShortestPath(_Path):
    """Request for the shortest of the paths to `requested_ends`. The index of the end that it leads to is
    `closest_end_point_index`, or -1 if no end can be reached."""

    def __init__(self) -> None:
        super().__init__()
        self.requested_ends: Any = []
        self.closest_end_point_index = -1


class PathFinder(_shared.FullySealed):
    """A NavMesh with Habitat-Sim's queries. Random points depend on `seed` alone."""

    def __init__(self) -> None:
        self._mesh: Any = None
        self._rng: Any = None
        self._seed = 0
        self._capsules: list[list[float]] = []  # Simulator.set_navmesh_dynamic_capsules.
        self._walker: Any = None

    # ---- The mesh
    @property
    def is_loaded(self) -> bool:
        """Whether there is a NavMesh."""
        return self._mesh is not None

    @property
    def nav_mesh_settings(self) -> Any:
        """Settings that the mesh was built with, a copy. None without a mesh."""
        return None if self._mesh is None else NavMeshSettings._of(self._mesh.settings)

    def load_nav_mesh(self, path: str) -> bool:
        """Reads a file. Returns False, and keeps the present mesh, if it cannot be read."""
        gsnav = _engine.library()
        try:
            self._mesh = gsnav.load_navmesh(str(path))
        except gsnav.Error as error:
            _engine.logger.warning("PathFinder.load_nav_mesh: %s", error)
            return False
        return True

    def save_nav_mesh(self, path: str) -> bool:
        """Writes a file. Returns False if there is no mesh or it cannot be written."""
        gsnav = _engine.library()
        if self._mesh is None:
            return False
        try:
            gsnav.save_navmesh(self._mesh, str(path))
        except gsnav.Error as error:
            _engine.logger.warning("PathFinder.save_nav_mesh: %s", error)
            return False
        return True

    def _need(self, what: str) -> Any:
        if self._mesh is None:
            raise RuntimeError(f"PathFinder.{what}: no NavMesh is loaded")
        return self._mesh

    def get_bounds(self) -> tuple[Vector3, Vector3]:
        """Corners of the bounding box of the tiles, metres. It reaches beyond the surface, as maps do."""
        box = self._need("get_bounds").tile_bounds()
        return Vector3(*box.low), Vector3(*box.high)

    def build_navmesh_vertices(self, island_index: int = -1) -> list[Vector3]:
        """Vertices of the surface or of one island."""
        return [Vector3(*v) for v in self._surface(island_index)[0]]

    def build_navmesh_vertex_indices(self, island_index: int = -1) -> list[int]:
        """Three indices per triangle of the surface or of one island."""
        return [int(i) for i in self._surface(island_index)[1].reshape(-1)]

    def _surface(self, island_index: int) -> Any:
        island_index = _engine.integer("PathFinder.build_navmesh_vertices: island_index", island_index)
        return self._need("build_navmesh_vertices").surface(None if island_index < 0 else island_index)

    # ---- Islands, numbered by decreasing area
    @property
    def num_islands(self) -> int:
        """Number of connected parts of the surface."""
        return self._need("num_islands").island_count()

    @property
    def navigable_area(self) -> float:
        """Area of the surface, square metres."""
        return self._need("navigable_area").navigable_area()

    def island_area(self, island_index: int = -1) -> float:
        """Area of an island or, for -1, of the surface, square metres."""
        mesh = self._need("island_area")
        island_index = _engine.integer("PathFinder.island_area: island_index", island_index)
        return mesh.navigable_area() if island_index < 0 else mesh.island_area(island_index)

    def island_radius(self, where: Any) -> float:
        """Radius of an island in metres, given by its index or by a point. 0 for a point off the mesh."""
        mesh = self._need("island_radius")
        island = where if isinstance(where, (int, np.integer)) else self.get_island(where)
        return 0.0 if island < 0 else mesh.island_radius(int(island))

    def get_island(self, point: Any) -> int:
        """Index of the island that a point snaps to, or -1."""
        mesh = self._need("get_island")
        at = self._snap(point, -1)
        return -1 if at is None else mesh.island_of(at.poly)

    # ---- Points
    def _snap(self, point: Any, island_index: int) -> Any:
        options = _snapping(None if island_index < 0 else island_index)
        return self._need("snap_point").snap_point(_triple(point), options)

    def snap_point(self, point: Any, island_index: int = -1) -> Vector3:
        """Nearest point of the surface within 2 m on the ground and 4 m in height. NaN if there is none."""
        island_index = _engine.integer("PathFinder.snap_point: island_index", island_index)
        at = self._snap(point, island_index)
        return Vector3(_NAN) if at is None else Vector3(*at.position)

    def is_navigable(self, pt: Any, max_y_delta: float = 0.5) -> bool:
        """Whether a point is at most `max_y_delta` metres above or below the surface, which may be infinite."""
        return self._need("is_navigable").is_navigable(_triple(pt), min(float(max_y_delta), 1e9))

    def seed(self, seed: int) -> None:
        """Seeds the random points. The same seed repeats them."""
        self._seed, self._rng = int(seed), None

    def _random(self) -> Any:
        if self._rng is None:
            self._rng = _engine.library().Rng(self._seed % 2**64)
        return self._rng

    def get_random_navigable_point(self, max_tries: int = 10, island_index: int = -1) -> Vector3:
        """Random point, uniform over the surface or one island. NaN for an island that does not exist."""
        mesh = self._need("get_random_navigable_point")
        island_index = _engine.integer("PathFinder.get_random_navigable_point: island_index", island_index)
        if island_index >= mesh.island_count():
            return Vector3(_NAN)
        return Vector3(*mesh.random_point(self._random(), None if island_index < 0 else island_index).position)

    def get_random_navigable_point_near(
        self, circle_center: Any, radius: float, max_tries: int = 100, island_index: int = -1
    ) -> Vector3:
        """Random point within `radius` metres of another, uniform over that part. NaN if it is empty. The radius may be
        infinite. Raises ValueError for one that is negative or NaN."""
        mesh = self._need("get_random_navigable_point_near")
        island_index = _engine.integer("PathFinder.get_random_navigable_point_near: island_index", island_index)
        _check_radius("get_random_navigable_point_near: radius", radius)
        if island_index >= mesh.island_count():
            return Vector3(_NAN)
        if math.isinf(radius) and np.isfinite(_triple(circle_center)).all():
            return self.get_random_navigable_point(max_tries, island_index)
        island = None if island_index < 0 else island_index
        at = mesh.random_point_near(self._random(), _triple(circle_center), radius, island)
        return Vector3(_NAN) if at is None else Vector3(*at.position)

    get_random_navigable_point_around = get_random_navigable_point_near

    # ---- Steps
    def _set_capsules(self, rows: list[list[float]]) -> None:
        self._capsules, self._walker = rows, None

    def try_step(self, start: Any, end: Any) -> Vector3:
        """Position after a step that slides along walls. The start is snapped first. The result is `start` where start
        or end cannot be snapped, and where they snap to two islands."""
        return self._step(start, end, True)

    def try_step_no_sliding(self, start: Any, end: Any) -> Vector3:
        """Position after a step that stops at the first wall. The rest is as for try_step."""
        return self._step(start, end, False)

    def _connected(self, start: Any, end: Any) -> bool:
        """Whether two points snap to one island. Habitat-Sim moves nothing where they do not."""
        first, last = self._snap(start, -1), self._snap(end, -1)
        if first is None or last is None:
            return False
        return first.poly == last.poly or self._mesh.island_of(first.poly) == self._mesh.island_of(last.poly)

    def _step(self, start: Any, end: Any, slide: bool) -> Vector3:
        mesh = self._need("try_step")
        if not self._connected(start, end):
            return Vector3(*_triple(start))
        if self._capsules:
            if self._walker is None or self._walker[0] is not mesh:
                self._walker = mesh, _engine.walker(mesh, self._capsules)
            return Vector3(*self._walker[1].move(_triple(start), _triple(end), 0.0, 0.0, slide))
        at = _engine.library().try_step(mesh, _triple(start), _triple(end), slide)
        return Vector3(*_triple(start)) if at is None else Vector3(*at.position)

    # ---- Walls
    def distance_to_closest_obstacle(self, pt: Any, max_search_radius: float = 2.0) -> float:
        """Ground distance to the nearest wall in metres, at most `max_search_radius`; infinite off the mesh. Raises
        ValueError for a radius that is negative or NaN."""
        _check_radius("distance_to_closest_obstacle: max_search_radius", max_search_radius)
        return self._need("distance_to_closest_obstacle").distance_to_closest_obstacle(_triple(pt), max_search_radius)

    def closest_obstacle_surface_point(self, pt: Any, max_search_radius: float = 2.0) -> HitRecord:
        """The nearest wall. Without one in reach, the position is NaN and the distance that of
        distance_to_closest_obstacle. Raises ValueError for a radius that is negative or NaN."""
        _check_radius("closest_obstacle_surface_point: max_search_radius", max_search_radius)
        hit = self._need("closest_obstacle_surface_point").closest_obstacle(_triple(pt), max_search_radius)
        if hit is None:
            return HitRecord([_NAN] * 3, [_NAN] * 3, self.distance_to_closest_obstacle(pt, max_search_radius))
        return HitRecord(hit.position, hit.normal, hit.distance)

    # ---- Paths
    def find_path(self, path: Any) -> bool:
        """Fills a ShortestPath or MultiGoalShortestPath. Returns whether there is a path; without one, the
        distance is infinite and there are no points."""
        mesh, gsnav = self._need("find_path"), _engine.library()
        path._clear()
        start = _triple(path.requested_start)
        try:
            if isinstance(path, MultiGoalShortestPath):
                path.closest_end_point_index = -1
                found = mesh.find_path_to_any(start, _rows(path.requested_ends))
                path.closest_end_point_index, found = found.goal, found.path
            else:
                found = mesh.find_path(start, _triple(path.requested_end))
        except (gsnav.NothingNavigable, gsnav.InvalidArgument):
            return False
        path.points = [Vector3(*p) for p in found.points.tolist()]
        path.geodesic_distance = found.length
        return True

    # ---- Maps
    def get_topdown_view(self, meters_per_pixel: float, height: float, eps: float = 0.5) -> np.ndarray:
        """Where the surface lies within `eps` metres of a height: bool [rows along z][columns along x]."""
        return self.get_topdown_island_view(meters_per_pixel, height, eps) >= 0

    def get_topdown_island_view(self, meters_per_pixel: float, height: float, eps: float = 0.5) -> np.ndarray:
        """Island of each cell or -1: int32 [rows along z][columns along x]."""
        layout = _engine.library().TopDownLayout.habitat
        grid = self._need("get_topdown_view").top_down_map(height, meters_per_pixel, eps, layout)
        return np.array(grid.islands)


@functools.lru_cache(maxsize=16)
def _snapping(island: int | None) -> Any:
    return _engine.library().SnapOptions(half_extents=_REACH, island=island)


def _check_radius(name: str, radius: float) -> None:
    if not radius >= 0:
        raise ValueError(f"PathFinder.{name} = {radius}: must be 0 or more metres")


def _triple(point: Any) -> list[float]:
    if isinstance(point, Vector3):
        return list(point)
    return [float(x) for x in np.asarray(point, dtype=np.float64).reshape(3)]


def _rows(points: Iterable[Any]) -> list[list[float]]:
    rows = np.asarray([_triple(p) for p in points], dtype=np.float64).reshape(-1, 3)
    return rows.tolist()


__all__ = ["GreedyFollowerCodes", "GreedyGeodesicFollower", "HitRecord", "MultiGoalShortestPath", "NavMeshSettings",
           "PathFinder", "ShortestPath"]  # fmt: skip
