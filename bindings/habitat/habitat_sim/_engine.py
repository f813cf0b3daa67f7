# SPDX-License-Identifier: Apache-2.0
"""The package gsnav, imported when it is first needed, and the scenes that simulators of a process share."""

import contextlib
import logging
import operator
import os
import threading
import weakref
from typing import Any, Iterator

from gsnav_habitat import _turns

logger = logging.getLogger("habitat_sim")
_lock = threading.Lock()
_MOST_PEOPLE = 1000  # As gsnav.open_scene.


def library() -> Any:
    """The package gsnav."""
    import gsnav

    return gsnav


class Stage:
    """A scene that was opened, with its renderers by device. Simulators of one scene share it."""

    def __init__(self, opened: Any) -> None:
        self.opened = opened
        self.scene = None if opened is None else opened.scene
        self._idle: dict[Any, list[tuple[str, tuple[float, ...], Any]]] = {}
        self._parts: "weakref.WeakValueDictionary[Any, Stage]" = weakref.WeakValueDictionary()
        self._gpu = threading.Lock()

    @contextlib.contextmanager
    def drawer(self, device: Any, key: str, specs: list[Any], background: tuple[float, ...]) -> Iterator[Any]:
        """A gsnav.FreeSensors of these gsnav.SensorSpec over a colour, for one thread at a time. Specifications with
        equal keys are equal. A GPU has one drawer, a CPU one per thread."""
        with self._gpu if device.kind == library().DeviceKind.cuda else contextlib.nullcontext():
            with _lock:
                idle = self._idle.setdefault(device, [])
                fitting = [i for i, (had, _, _) in enumerate(idle) if had == key]
                before, behind, found = idle.pop(fitting[0] if fitting else -1) if idle else ("", (), None)
            if found is None:
                found = library().FreeSensors(device, self.scene, specs)
            elif before != key:
                found.set_sensors(specs)
            if behind != background:
                found.set_background(background)
            yield found
            idle.append((key, background, found))  # Not after an error.

    def showing(self, people: list[int]) -> "Stage":
        """The scene with these of its people only, for drawing."""
        if len(people) == self.scene.avatar_count:
            return self
        with _lock:
            found = self._parts.get(tuple(people))
            if found is None:
                found = self._parts[tuple(people)] = Stage(None)
                found.scene = library().SimulatorScene(self.scene, people=people)
            return found

    @property
    def navmesh(self) -> Any:
        """The NavMesh beside the scene or built for it, or None."""
        return None if self.scene is None else self.scene.navmesh


_stages: "weakref.WeakValueDictionary[Any, Stage]" = weakref.WeakValueDictionary()


def _stamp(name: str) -> Any:
    try:
        status = os.stat(name)
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size


def integer(what: str, value: Any) -> int:
    """An integer of Python or numpy. Raises TypeError naming `what` for anything else."""
    try:
        return operator.index(value)
    except TypeError:
        raise TypeError(f"{what} = {value!r}: must be an integer") from None


def capsule(what: str, radius: float, height: float) -> tuple[float, float]:
    """Radius and height of a body among people, metres. Raises ValueError for a body that is wider than high."""
    if float(radius) > float(height) / 2:
        raise ValueError(
            f"{what}: radius = {radius}, height = {height}: among people a body is a capsule within its height, so the "
            "radius must be at most half of the height"
        )
    return float(radius), float(height)


def walker(mesh: Any, capsules: list[list[float]]) -> Any:
    """A gsnav.AvatarTracker among capsules, of the agent that a NavMesh was built for."""
    gsnav, body = library(), mesh.settings
    radius, height = capsule("NavMeshSettings", body.agent_radius, body.agent_height)
    made = gsnav.AvatarTracker(gsnav.SimulatorScene(navmesh=mesh), radius, height)
    made.set_capsules(capsules)
    return made


def is_empty(name: Any) -> bool:
    """Whether a scene's name stands for no scene."""
    return str(name) in ("NONE", "")


def stage(name: str, settings: Any, required: bool = False) -> Stage:
    """The scene of a name: a path, a name that gsnav.open_scene knows, or NONE for nothing.

    The NavMesh is the file beside the scene, or else one that is built with a gsnav.NavMeshSettings. One is also built
    if the file has other settings and these are `required`. Raises FileNotFoundError naming the scene, InvalidArgument
    naming a required setting out of range, and the errors of gsnav.open_scene.
    """
    people = _people()
    if is_empty(name):
        return Stage(None)
    gsnav = library()
    if required:
        settings.validate()
    stem, extension = os.path.splitext(name)
    beside = next((p for p in (stem + ".navmesh", name + ".navmesh") if extension and os.path.isfile(p)), None)
    key = (os.path.abspath(name), _stamp(name), beside, beside and _stamp(beside),
           repr(settings) if required or not beside else None, people)  # fmt: skip
    with _lock:
        found = _stages.get(key)
        if found is None:
            found = _stages[key] = Stage(_open(gsnav, name, beside, settings, required))
        return found


def _people() -> int:
    """GSNAV_PEOPLE: how many procedural people walk in each scene. 0: those that belong to it."""
    text = os.environ.get("GSNAV_PEOPLE") or "0"
    if not text.isdecimal() or len(text) > 4 or int(text) > _MOST_PEOPLE:
        raise ValueError(f"GSNAV_PEOPLE = {text}: must be a number of people in [0, {_MOST_PEOPLE}]")
    return int(text)


# Fields of NavMeshSettings that Habitat-Sim compares.
_COMPARED = (
    "cell_size", "cell_height", "agent_height", "agent_radius", "agent_max_climb", "agent_max_slope",
    "filter_low_hanging_obstacles", "filter_ledge_spans", "filter_walkable_low_height_spans", "region_min_size",
    "edge_max_len", "edge_max_error", "verts_per_poly", "detail_sample_dist", "detail_sample_max_error",
)  # fmt: skip


def _differing(had: Any, wanted: Any, gaussians: bool) -> list[str]:
    """Names of the settings in which a NavMesh differs from one that would be built."""
    found = [name for name in _COMPARED if abs(float(getattr(had, name)) - float(getattr(wanted, name))) >= 1e-5]
    lowered = min(wanted.cell_height, max(0.05, wanted.cell_size))  # gsnav's voxels among Gaussians.
    if gaussians and abs(had.cell_height - lowered) < 1e-5:
        found = [name for name in found if name != "cell_height"]
    return found


def _open(gsnav: Any, name: str, beside: str | None, settings: Any, required: bool) -> Any:
    def opened(how: str) -> Any:
        return gsnav.open_scene(name, gsnav.OpenOptions(navmesh=how, navmesh_settings=settings, people=_people()))

    try:
        found = opened(beside or "auto")
    except (gsnav.NothingNavigable, gsnav.InvalidArgument) as error:
        if beside is not None:
            raise
        logger.warning("%s: no NavMesh: %s", name, error)
        return gsnav.open_scene(name, gsnav.OpenOptions(navmesh="none"))
    mesh = found.scene.navmesh
    differing = _differing(mesh.settings, settings, found.gaussian_count > 0) if required and mesh is not None else []
    if not differing:
        return found
    logger.info("%s: NavMesh built, because %s differs, %s", name, ", ".join(differing), found.navmesh_source)
    try:
        return opened("build")
    except (gsnav.NothingNavigable, gsnav.InvalidArgument) as error:
        logger.warning("%s: NavMesh of other settings, %s: %s", name, found.navmesh_source, error)
        return found


def device(gpu_device_id: int) -> Any:
    """GSNAV_DEVICE if it is set. Else the GPU of this number if the package and the machine have it, else the
    CPU. A CPU gets only the threads that the present thread may draw on (_turns.share)."""
    gsnav = library()
    chosen = os.environ.get("GSNAV_DEVICE")
    if chosen:
        found = gsnav.Device.parse(chosen)
    else:
        found = gsnav.Device.parse("cpu")
        if gpu_device_id >= 0:
            with contextlib.suppress(gsnav.Error):
                found = gsnav.Device.parse(f"cuda:{gpu_device_id}")
    share = _turns.share()
    return gsnav.Device.parse(f"cpu:{share}") if share and found.kind == gsnav.DeviceKind.cpu else found


def threads() -> int:
    """Threads of the CPU that a process draws on: those of GSNAV_DEVICE or OMP_NUM_THREADS, or else its cores."""
    for text in (os.environ.get("GSNAV_DEVICE", "").removeprefix("cpu:"), os.environ.get("OMP_NUM_THREADS", "")):
        if text.isdecimal() and int(text) > 0:
            return int(text)
    return len(os.sched_getaffinity(0))
