#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Times gsplat on a scene of gsnav, and compares its images with gsnav's float64 reference.

Needs an NVIDIA GPU, torch and gsplat 1.6 or later; gsnav does not need them. Prints rows of a
Markdown table: image, size, cameras per call, ms per frame (median and 90th percentile), PSNR in dB
(worst view) and GPU memory in MB (the scene included).

With one camera per call, times are those of the views of --cameras, one after another. With more, they
are those of nine calls; the views repeat 2 cm apart. CUDA events stand around the whole call. Both
layouts of gsplat, dense and packed, are measured; the row is that of the faster one.

The reference is a folder of NNNN.rgb.npy by `gsnav-render --device serial64 --up keep --npy`. Its N images
are of N views evenly spread over the cameras file, as bench_batch compares them: views 0, 16, 32 and 48 of 64.

  gsplat_rows.py --scene flat.ply --cameras cameras.json --size 256x256 --batch 1,256 --reference DIR
"""
import argparse
import json
import pathlib
import statistics
import sys

try:
    import numpy as np
    import torch
except ImportError as error:
    missing = error.name
else:
    missing = None

NEAR = 0.2  # metres, as gsnav
REPEATS = 9  # calls that are timed


def read_ply(path):
    """Columns of a binary little-endian PLY of floats, by name."""
    with open(path, "rb") as f:
        names, count = [], 0
        while (line := f.readline().split()) != [b"end_header"]:
            if not line:
                sys.exit(f"{path}: no end of the header")
            if line[:2] == [b"element", b"vertex"]:
                count = int(line[2])
            elif line[0] == b"property":
                if line[1] != b"float":
                    sys.exit(f"{path}: property {line[2].decode()} is no float")
                names.append(line[2].decode())
        rows = np.fromfile(f, dtype="<f4", count=count * len(names)).reshape(count, len(names))
    return {name: rows[:, i] for i, name in enumerate(names)}


def load_scene(path):
    """Means, quaternions, scales, opacities and SH coefficients [N][16][3] as tensors on the GPU."""
    ply = read_ply(path)
    rest = sum(name.startswith("f_rest_") for name in ply)
    bands = 1 + rest // 3
    sh = np.zeros((len(ply["x"]), bands, 3), np.float32)
    for c in range(3):
        sh[:, 0, c] = ply[f"f_dc_{c}"]
        for k in range(1, bands):
            sh[:, k, c] = ply[f"f_rest_{c * (bands - 1) + k - 1}"]
    columns = lambda *names: torch.tensor(np.stack([ply[n] for n in names], axis=-1), device="cuda")
    quaternions = torch.nn.functional.normalize(columns("rot_0", "rot_1", "rot_2", "rot_3"))
    return (columns("x", "y", "z"), quaternions, columns("scale_0", "scale_1", "scale_2").exp(),
            columns("opacity").sigmoid()[:, 0], torch.tensor(sh, device="cuda"), int(round(bands**0.5)) - 1)


def load_cameras(path, width, height):
    """World-to-camera matrices [C][4][4] and intrinsics [C][3][3] of an INRIA cameras.json."""
    views, intrinsics = [], []
    for camera in json.loads(pathlib.Path(path).read_text()):
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = np.array(camera["rotation"]), np.array(camera["position"])
        views.append(np.linalg.inv(pose))
        scale = width / camera["width"]  # square pixels, as bench_batch --size
        intrinsics.append([[camera["fx"] * scale, 0, width / 2], [0, camera["fy"] * scale, height / 2], [0, 0, 1]])
    return np.array(views), np.array(intrinsics)


def timed(call):
    """Milliseconds of one call between CUDA events."""
    begin, end = torch.cuda.Event(enable_timing=True), torch.cuda.Event(enable_timing=True)
    begin.record()
    call()
    end.record()
    torch.cuda.synchronize()
    return begin.elapsed_time(end)


def measure(draw, cameras, batch):
    """Median and 90th percentile of the milliseconds per frame, and the largest memory in MB."""
    torch.cuda.reset_peak_memory_stats()
    if batch == 1:
        views = range(cameras)
        for i in views:
            draw(i, 1)
        times = [timed(lambda i=i: draw(i, 1)) for i in views]
    else:
        draw(0, batch)
        times = [timed(lambda: draw(0, batch)) / batch for _ in range(REPEATS)]
    return (statistics.median(times), sorted(times)[int(0.9 * (len(times) - 1))],
            torch.cuda.max_memory_allocated() / 2**20)


def psnr(images, views, folder):
    """PSNR of the worst view against the references of a folder; nan without any. images(i): image of view i."""
    worst, files = float("nan"), sorted(pathlib.Path(folder).glob("*.rgb.npy")) if folder else []
    for i, file in enumerate(files):
        error = np.mean((np.load(file).astype(np.float64) - images(i * views // len(files))) ** 2)
        worst = np.fmin(worst, -10 * np.log10(max(error, 1e-30)))
    return worst


def rows_of_rasterization(scene, views, intrinsics, width, height, batch, reference):
    """Prints a row per kind of image of gsplat.rasterization."""
    from gsplat import rasterization

    means, quats, scales, opacities, sh, degree = scene
    repeats = -(-batch // len(views))
    moved = np.concatenate([views] * repeats)
    moved[:, 0, 3] += 0.02 * np.repeat(np.arange(repeats), len(views))
    v = torch.tensor(moved, dtype=torch.float32, device="cuda")
    k = torch.tensor(np.concatenate([intrinsics] * repeats), dtype=torch.float32, device="cuda")
    for name, mode in (("RGB, alpha", "RGB"), ("RGB, alpha, expected depth", "RGB+ED"), ("expected depth", "ED")):

        def draw(first, count, packed, mode=mode):
            colours = dict(colors=None) if mode == "ED" else dict(colors=sh, sh_degree=degree)
            return rasterization(means, quats, scales, opacities, viewmats=v[first:first + count],
                                 Ks=k[first:first + count], width=width, height=height, near_plane=NEAR,
                                 packed=packed, render_mode=mode, **colours)[0]

        best, which = None, ""
        for packed in (False, True):
            try:
                row = measure(lambda i, n, packed=packed: draw(i, n, packed), len(views), batch)
            except torch.cuda.OutOfMemoryError:
                torch.cuda.empty_cache()
                continue
            if best is None or row < best:
                best, which = row, "packed" if packed else "dense"
        if best is None:
            print(f"| gsplat, {name} | {width}x{height} | {batch} | out of memory | | | |", flush=True)
            continue
        quality = float("nan") if mode == "ED" else psnr(
            lambda i, packed=which == "packed": draw(i, 1, packed)[0, :, :, :3].double().cpu().numpy(),
            len(views), reference)
        print(f"| gsplat, {name} ({which}) | {width}x{height} | {batch} | {best[0]:.4f} | {best[1]:.4f} "
              f"| {quality:.1f} | {best[2]:.0f} |", flush=True)


def rows_of_inference(scene, views, intrinsics, width, height, reference):
    """Prints a row per tile size of gsplat's renderer for inference (HiGS), one camera per call."""
    from gsplat.experimental.render import GaussianInferenceRenderer
    from gsplat.scene import GaussianInferenceScene

    inference = GaussianInferenceScene.from_gaussian_tensors(*scene, "none", id="scene")
    v = torch.tensor(views, dtype=torch.float32, device="cuda")
    k = torch.tensor(intrinsics, dtype=torch.float32, device="cuda")
    for tile in (8, 16):
        renderer = GaussianInferenceRenderer(inference, tile_size=tile)
        draw = lambda i, n: renderer.render(viewmat=v[i], K=k[i], width=width, height=height, near_plane=NEAR)

        def image(i):
            return draw(i, 1).frame[0, :, :, :3].double().cpu().numpy()

        row = measure(draw, len(views), 1)
        print(f"| gsplat for inference, RGB (tiles of {tile}) | {width}x{height} | 1 | {row[0]:.4f} | {row[1]:.4f} "
              f"| {psnr(image, len(views), reference):.1f} | {row[2]:.0f} |", flush=True)
        renderer.release()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", required=True, help="PLY of 3D Gaussians")
    parser.add_argument("--cameras", required=True, help="INRIA cameras.json, in the axes of the scene")
    parser.add_argument("--size", default="256x256", help="image size (default: %(default)s)")
    parser.add_argument("--batch", default="1,256", help="cameras per call (default: %(default)s)")
    parser.add_argument("--reference", help="folder of NNNN.rgb.npy of evenly spread views; without it, PSNR is nan")
    parser.add_argument("--inference", action="store_true", help="also gsplat's renderer for inference")
    options = parser.parse_args()
    if missing:
        sys.exit(f"gsplat_rows.py: {missing} is missing; pip install numpy torch, and build gsplat 1.6 or later")
    width, height = map(int, options.size.split("x"))
    torch.set_grad_enabled(False)
    import gsplat

    scene = load_scene(options.scene)
    views, intrinsics = load_cameras(options.cameras, width, height)
    print(f"gsplat {gsplat.__version__}, torch {torch.__version__}, {torch.cuda.get_device_name(0)}, "
          f"{len(scene[0])} Gaussians, {len(views)} views", flush=True)
    for batch in map(int, options.batch.split(",")):
        rows_of_rasterization(scene, views, intrinsics, width, height, batch, options.reference)
    if options.inference:
        rows_of_inference(scene, views, intrinsics, width, height, options.reference)


if __name__ == "__main__":
    main()
