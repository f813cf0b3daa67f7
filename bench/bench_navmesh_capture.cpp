// SPDX-License-Identifier: Apache-2.0
// Builds a NavMesh from Gaussians over the extent of an outdoor capture: time, processor time and peak
// memory.
#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "gsnav/detail/nav/gaussian_navmesh.hpp"
#include "large_capture.hpp"

namespace {

struct Usage {
  double user = 0, peak_mb = 0;
};
Usage used() {
  rusage u{};
  getrusage(RUSAGE_SELF, &u);
  return {static_cast<double>(u.ru_utime.tv_sec) + 1e-6 * static_cast<double>(u.ru_utime.tv_usec),
          static_cast<double>(u.ru_maxrss) / 1024};
}

}  // namespace

/// bench_navmesh_capture [cell size in metres = 0.05] [Gaussians = 850000] [threads = 2]
int main(int argc, char** argv) {
  using namespace gsnav;
  using Clock = std::chrono::steady_clock;
  const auto count = static_cast<std::size_t>(argc > 2 ? std::atof(argv[2]) : 850000);
  const GaussianCloud cloud = gsnav_bench::large_capture(count);
  Similarity upright;
  upright.rotation = axis_angle(Vec3d{1, 0, 0}, -1.5707963267948966);
  const GaussianSet set = cloud.set(upright);
  NavMeshSettings settings = gaussian_navmesh_settings();
  settings.cell_size = settings.cell_height = argc > 1 ? std::atof(argv[1]) : 0.05;
  GaussianNavOptions options;
  options.threads = argc > 3 ? std::atoi(argv[3]) : 2;
  const Usage before = used();
  const auto from = Clock::now();
  options.progress = [&, stage = std::string()](const char* name, double) mutable {
    if (stage == name) return;
    stage = name;
    const Usage now = used();
    std::printf("%6.1f s, %6.1f s of processors, %5.0f MB: %s\n",
                std::chrono::duration<double>(Clock::now() - from).count(), now.user - before.user,
                now.peak_mb, name);
  };
  const auto built = build_navmesh(settings, {&set, 1}, options);
  if (!built.ok()) {
    std::fprintf(stderr, "%s\n", built.message().c_str());
    return 1;
  }
  const Usage after = used();
  const GaussianNavReport& r = built->report;
  const Vec3d size = r.bounds.high - r.bounds.low;
  std::printf("%zu Gaussians, %zu outliers; box %.0f x %.0f x %.0f m, %zu solid voxels of %zu\n",
              cloud.size(), r.gaussians_outside, size.x, size.y, size.z, r.solid_voxels, r.voxels);
  std::printf("%zu polygons, %.0f m2, the largest island %.0f m2, %zu storeys\n",
              built->mesh.polygon_count(), r.area, built->mesh.island_area(0), r.storeys.size());
  std::printf("%.1f s, %.1f s of processors, peak %.0f MB (%.0f before)\n",
              std::chrono::duration<double>(Clock::now() - from).count(), after.user - before.user,
              after.peak_mb, before.peak_mb);
  return 0;
}
