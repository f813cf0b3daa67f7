// SPDX-License-Identifier: Apache-2.0
// Touches each component that it was linked with, so that a missing link or header shows.
#include <cstdio>
#include <gsnav/backends/serial.hpp>
#include <gsnav/gsnav.hpp>
#include <vector>
#if defined(WITH_OPENMP)
#include <gsnav/backends/openmp.hpp>
#endif
#if defined(WITH_DEVICE)
#include <gsnav/device/renderer.hpp>
#endif
#if defined(WITH_DEMO)
#include <gsnav/demo.hpp>
#endif
#if defined(WITH_RIGGING)
#include <gsnav/rigging.hpp>
#endif
#if defined(WITH_IO)
#include <gsnav/detail/io/sog.hpp>
#include <gsnav/io/image_file.hpp>
#endif
#if defined(WITH_NAV)
#include <gsnav/detail/nav/navmesh_settings.hpp>
#endif
#if defined(WITH_SIM)
#include <gsnav/detail/sim/task.hpp>
#endif
#if defined(WITH_EVAL)
#include <gsnav/detail/eval/ssim.hpp>
#endif
#if defined(WITH_INTEROP_EIGEN)
#include <gsnav/interop/eigen.hpp>
#endif
#if defined(WITH_INTEROP_DLPACK)
#include <gsnav/interop/dlpack.hpp>
#endif
#if defined(WITH_INTEROP_GLM)
#include <gsnav/interop/glm.hpp>
#endif

namespace {

int failures = 0;

void check(const char* what, bool ok) {
  std::printf("%-14s %s\n", what, ok ? "ok" : "FAILED");
  failures += ok ? 0 : 1;
}

template <class B>
bool renders_one_gaussian(B& backend) {
  gsnav::GaussianCloud cloud;
  for (auto& column : cloud.means) column = {0};
  for (auto& column : cloud.quats) column = {0};
  for (auto& column : cloud.scales) column = {0.5f};
  cloud.means[2] = {2};
  cloud.quats[0] = {1};
  cloud.opacities = {0.9f};
  cloud.sh0 = {1, 1, 1};
  gsnav::BasicRenderer<float, B> renderer(backend);
  const auto camera = gsnav::Camera::look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, 32, 32, 90);
  return renderer.render(cloud.set(), camera).value().alpha[16 * 32 + 16] > 0.8f;
}

}  // namespace

int main() {
  gsnav::SerialBackend serial;
  check("gsnav", renders_one_gaussian(serial));
#if defined(WITH_OPENMP)
  gsnav::OpenMPBackend openmp;
  check("openmp", renders_one_gaussian(openmp));
#endif
#if defined(WITH_AVATAR)
  check("avatar", gsnav::WalkTrajectory::create({{0, 0, 0}, {1, 0, 0}}).ok());
#endif
#if defined(WITH_RIGGING)
  check("rigging", gsnav::find_feet(gsnav::Skeleton{}).empty());
#endif
#if defined(WITH_DEMO)
  check("demo",
        gsnav::try_make_humanoid({.gaussians = 2000}).ok() && gsnav::make_default_scene(0.05).ok());
#endif
#if defined(WITH_IO)
  // Each format's library must be linked: PNG, and WebP and zlib behind SOG.
  const std::vector<float> pixel{1, 0, 0};
  check("io", gsnav::io::save_png_rgb("consumer.png", pixel, 1, 1).ok() &&
                  gsnav::io::load_png("consumer.png").value().samples[0] == 255 &&
                  gsnav::io::load_sog("no_such_file.sog").code() == gsnav::Errc::file_not_found);
#endif
#if defined(WITH_NAV)
  check("nav", gsnav::NavMeshSettings{}.validate().ok());
#endif
#if defined(WITH_SIM)
  check("sim", gsnav::validate(gsnav::TaskConfig{}).ok());
#endif
#if defined(WITH_DEVICE)
  check("device", gsnav::Device::parse("best").ok() &&
                      gsnav::Renderer::create(gsnav::Device(), gsnav::GaussianCloud{}).ok());
#endif
#if defined(WITH_EVAL)
  check("eval", gsnav::eval::ssim(std::vector<float>{1, 0, 0}, std::vector<float>{1, 0, 0}, 1, 1).ok());
#endif
#if defined(WITH_INTEROP_EIGEN)
  check("interop_eigen", gsnav::interop::to_eigen(gsnav::Quatd{}).w() == 1.0);
#endif
#if defined(WITH_INTEROP_DLPACK)
  check("interop_dlpack", gsnav::interop::dlpack_type<float>().bits == 32);
#endif
#if defined(WITH_INTEROP_GLM)
  check("interop_glm", gsnav::interop::to_glm(gsnav::Quatd{}).w == 1.0);
#endif
  return failures;
}
