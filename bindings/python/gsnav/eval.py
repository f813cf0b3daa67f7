# SPDX-License-Identifier: Apache-2.0
"""Measuring errors: float64 reference images, errors of images and depths, and speed against error."""

from __future__ import annotations

import dataclasses
import math
import statistics
import time
from collections.abc import Callable, Sequence

from ._errors import InvalidArgument
from ._gsnav import (
    Camera,
    DepthError,
    DepthErrorOptions,
    Device,
    ImageError,
    OpenedScene,
    OracleConfig,
    OracleCounts,
    OracleFrames,
    OracleKind,
    OracleOrder,
    Output,
    PixelRect,
    RenderConfig,
    Renderer,
    RenderOptions,
    SimulatorScene,
    depth_error,
    image_error,
    oracle_photo,
    oracle_render,
)

__all__ = ["DepthError", "DepthErrorOptions", "ErrorReport", "ImageError", "OracleConfig", "OracleCounts",
           "OracleFrames", "OracleKind", "OracleOrder", "PixelRect", "ViewError", "depth_error", "error_report",
           "image_error", "oracle_photo", "oracle_render"]


@dataclasses.dataclass(frozen=True)
class ViewError:
    """Error and time of one view."""

    image: ImageError  # errors of the colours
    depth: DepthError  # errors of the median depth
    milliseconds: float  # median time of a call of Renderer.render


@dataclasses.dataclass(frozen=True)
class ErrorReport:
    """Speed and error of a renderer over views."""

    views: list[ViewError]  # in the order of the cameras

    @property
    def psnr(self) -> float:
        """PSNR of the mean square error of all views, dB. Infinity if all images are equal."""
        error = statistics.fmean(10 ** (-v.image.psnr / 10) for v in self.views)
        return -10 * math.log10(error) if error > 0 else math.inf

    @property
    def worst_psnr(self) -> float:
        """PSNR of the worst view, dB."""
        return min(v.image.psnr for v in self.views)

    @property
    def max_error(self) -> float:
        """Largest error of a colour, without pixels that float32 may rightly decide differently."""
        return max(v.image.max for v in self.views)

    @property
    def max_depth_error(self) -> float:
        """Largest error of a median depth, metres, without such pixels."""
        return max(v.depth.max for v in self.views)

    @property
    def milliseconds(self) -> float:
        """Median time of a view."""
        return statistics.median(v.milliseconds for v in self.views)

    def __str__(self) -> str:
        return (f"{len(self.views)} views: PSNR {self.psnr:.1f} dB, worst {self.worst_psnr:.1f} dB, largest error "
                f"{self.max_error:.2g}, of depth {self.max_depth_error:.2g} m, {self.milliseconds:.2f} ms per view")


def error_report(device: Device | str, scene: OpenedScene | SimulatorScene, cameras: Sequence[Camera],
                 options: RenderOptions | None = None, *, runs: int = 5, photo: int = 0,
                 depth: DepthErrorOptions | None = None,
                 progress: Callable[[float], object] | None = None) -> ErrorReport:
    """Compares images of a Renderer with float64 reference images, view by view.

    options: settings of the renderer, such as `Quality.fast()`. The reference follows the image contract, with the
        background, colour space and first_hit_tau of these settings.
    runs: number of timed calls per view, after one that is not timed. The time includes the copy into arrays.
    photo: 0 compares with oracle_render; 2 to 16 with oracle_photo of this factor, which judges levels of detail.
    depth: pixels whose depths are compared.
    progress: called after each view with the share that is done, in [0, 1].

    Reference images take seconds per view. Ctrl-C ends the call after the present one. Raises what Renderer and
    oracle_render raise.
    """
    options = RenderOptions() if options is None else options
    if not cameras:
        raise InvalidArgument("error_report: cameras is empty")
    if runs < 1:
        raise InvalidArgument(f"error_report: runs = {runs}: must be positive")
    given = options.render
    rules = RenderConfig(background=given.background, blend_space=given.blend_space, first_hit_tau=given.first_hit_tau)
    drawn = RenderConfig(**{**given.__getstate__(), "outputs": Output.kRgb | Output.kMedianDepth})
    renderer = Renderer(device, scene, RenderOptions(render=drawn, detail=options.detail))
    oracle = OracleConfig(rules=rules)
    views = []
    for i, camera in enumerate(cameras):
        frames = renderer.render(camera)
        times = []
        for _ in range(runs):
            start = time.perf_counter()
            frames = renderer.render(camera)
            times.append(1e3 * (time.perf_counter() - start))
        truth = oracle_photo(device, scene, camera, photo, oracle) if photo else oracle_render(device, scene, camera,
                                                                                                oracle)
        # Samples of a photo lie close together, so nearly every pixel has one that rounding decides.
        undecided, undecided_depth = (None, None) if photo else (truth.undecided,
                                                                 truth.undecided | truth.undecided_depth)
        assert frames.rgb is not None and frames.median_depth is not None
        views.append(ViewError(
            image_error(truth.rgb, frames.rgb, undecided),
            depth_error(truth.median_depth, frames.median_depth, truth.alpha, undecided_depth,
                        DepthErrorOptions() if depth is None else depth),
            statistics.median(times)))
        if progress is not None:
            progress((i + 1) / len(cameras))
    return ErrorReport(views)
