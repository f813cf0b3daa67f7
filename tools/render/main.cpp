// SPDX-License-Identifier: Apache-2.0
// gsnav-render: renders images of a scene of Gaussians from the cameras of a file.
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "../common/check_values.hpp"
#include "gsnav/backends/serial.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gsnav/device/renderer.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/io/image_file.hpp"
#include "gsnav/mesh/mesh.hpp"
#include "gsnav/open.hpp"
#include "gsnav/render/config.hpp"
#include "gsnav/render/frames.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "gsnav/scene/lod_cut.hpp"
#include "gsnav/scene/prepare.hpp"
#include "gsnav/sim/basic_simulator.hpp"  // SceneOnBackend, CutSets
#include "gsnav/sim/scene.hpp"
#include "options.hpp"
#include "scene.hpp"

namespace {

using namespace gsnav;
using gsnav_render::fail;
using gsnav_render::Options;
using gsnav_render::Scene;

constexpr const char *kRgbNpy = ".rgb.npy", *kDepthNpy = ".depth.npy", *kAlphaNpy = ".alpha.npy",
                     *kRgbPng = ".rgb.png", *kDepthPng = ".depth.png";

/// Checks that the images can be written, and makes their folder. Before the scene is there, a folder
/// that could be made is left for later.
Status make_room(const Options& o, bool before_scene) {
  std::filesystem::path there = std::filesystem::absolute(o.out);
  std::error_code error;
  while (!std::filesystem::exists(there, error) && there.has_relative_path())
    there = there.parent_path();
  const bool can_be_made =
      std::filesystem::is_directory(there, error) && ::access(there.c_str(), W_OK | X_OK) == 0;
  if (before_scene && can_be_made && !std::filesystem::exists(o.out, error)) return {};
  Status s = make_output_folder(o.out);
  if (s && o.npy) s = gsnav_tools::check_files_in(o.out, {kRgbNpy, kDepthNpy, kAlphaNpy});
  if (s && o.png) s = gsnav_tools::check_files_in(o.out, {kRgbPng, kDepthPng});
  return s ? s : Status(s.code(), "--out " + s.message());
}

/// Colours depth over the requested range, or over the image's own range from its 2nd to its 98th
/// percentile.
std::vector<std::uint8_t> depth_picture(const std::vector<float>& metres, const Options& o) {
  float near = static_cast<float>(o.depth_near), far = static_cast<float>(o.depth_far);
  if (!(far > near)) {
    std::vector<float> seen;
    std::copy_if(metres.begin(), metres.end(), std::back_inserter(seen), [](float z) { return z > 0; });
    std::sort(seen.begin(), seen.end());
    near = seen.empty() ? 0.0f : seen[seen.size() / 50];
    far = seen.empty() ? 0.0f : seen[seen.size() - 1 - seen.size() / 50];
    if (!(far > near)) far = near + 1.0f;
  }
  return io::colorize_depth(metres, near, far);
}

/// The image of a kind of depth. Compilers warn where a kind is missing here.
template <class S>
const std::vector<S>* depth_of(const Frames<S>& f, Output kind) {
  switch (kind) {
    case kMedianDepth:
      return &f.median_depth;
    case kExpectedDepth:
      return &f.expected_depth;
    case kAccumulatedDepth:
      return &f.accumulated_depth;
    case kFirstHitDepth:
      return &f.first_hit_depth;
    case kRgb:
    case kAlpha:
      break;
  }
  return nullptr;
}

/// Writes the files of one camera.
template <class S>
Status write_images(const Frames<S>& f, const Camera& camera, std::size_t index, const Options& o) {
  const std::vector<S>* const z = depth_of(f, o.depth_choice.output);
  if (z == nullptr)
    return Status(Errc::invalid_argument, "--depth " + o.depth + ": not a kind of depth");
  char number[24];
  std::snprintf(number, sizeof number, "%04zu", index);
  const std::filesystem::path stem = std::filesystem::path(o.out) / number;
  const std::vector<float> rgb(f.rgb.begin(), f.rgb.end()), alpha(f.alpha.begin(), f.alpha.end()),
      metres(z->begin(), z->end());
  const std::vector<std::size_t> image{f.height, f.width}, color{f.height, f.width, 3};
  Status s;
  const auto keep = [&](Status next) {
    if (s.ok()) s = std::move(next);
  };
  if (o.npy) {
    keep(io::save_npy(stem.string() + kRgbNpy, rgb, color));
    keep(io::save_npy(stem.string() + kDepthNpy, metres, image));
    keep(io::save_npy(stem.string() + kAlphaNpy, alpha, image));
  }
  if (o.png) {
    const int w = camera.width, h = camera.height;
    keep(io::save_png_rgb(stem.string() + kRgbPng, rgb, w, h));
    keep(io::save_png_rgb8(stem.string() + kDepthPng, depth_picture(metres, o), w, h));
  }
  return s;
}

RenderOptions how_to_draw(const Options& o, const OpenedScene& scene) {
  RenderOptions how;
  RenderConfig& config = how.render;
  config.outputs = kRgb | kAlpha | o.depth_choice.output;
  config.quality = gsnav_tools::quality_of(o);
  config.quality.max_alpha = o.max_alpha;
  config.first_hit_tau = o.depth_choice.tau;
  config.composite = o.composite == "merged" ? Composite::merged : Composite::hard_depth;
  how.detail = gsnav_tools::detail_of(o, scene);
  return how;
}

/// The part of the scene that a camera sees, in host memory, for the ledger and the float64 reference.
class HostView {
 public:
  HostView(std::shared_ptr<const SimulatorScene> scene, const RenderOptions& how)
      : scene_(backend_, std::move(scene), how.detail),
        config_(scene_.render_config(how.render)),
        reference_(backend_) {}

  void look(const Camera& camera) {
    const bool whole = scene_.levels() == nullptr;
    sets_ = whole ? scene_.assets() : cuts_.select(*scene_.levels(), scene_.assets(), camera);
    rules_ = whole ? config_ : cuts_.rules(config_);
  }
  /// Ledger of the last camera, for a frame with these counts.
  FrameLedger ledger(const Camera& camera, const RenderStats& stats, const LoadReport& report) const {
    const SceneAsset& asset = scene_.scene().assets[0];
    const LodCut* const cut = asset.lod != nullptr ? &cuts_.cut(0) : nullptr;
    FrameLedger l = frame_ledger(sets_, camera, rules_, stats, &report, asset.bands.get(), cut);
    l.unseen = cuts_.unseen();
    if (asset.visible != nullptr) l.unseen_weight = asset.visible->min_weight;
    return l;
  }
  /// Renders with the float64 reference.
  Status render(const Camera& camera, const MeshLight& light, Frames<double>& out) {
    look(camera);
    reference_.set_config(rules_);
    reference_.set_meshes(scene_.meshes().instances, light);
    return reference_.render(sets_, std::span(&camera, 1), out);
  }

 private:
  SerialBackend backend_;
  SceneOnBackend<SerialBackend> scene_;
  RenderConfig config_, rules_;
  CutSets cuts_;
  std::span<const GaussianSet> sets_;
  BasicRenderer<double, SerialBackend> reference_;
};

/// Renders the scene's cameras one after another, writes their images and prints the progress.
/// @param host The scene in host memory, which the ledger of a frame is computed from.
/// @param draw Called as draw(camera, light of the meshes, frames). Renders into the frames and returns
///   a Status.
/// @return the program's exit status: 1 after an error, which is printed.
template <class S, class Draw>
int run(const Options& o, const Scene& scene, HostView& host, const Draw& draw) {
  const std::vector<Camera>& cameras = scene.cameras;
  MeshLight headlight;
  headlight.unlit = false;
  Frames<S> f;
  double total_ms = 0;
  const bool terminal = isatty(fileno(stdout)) != 0;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const auto start = std::chrono::steady_clock::now();
    headlight.direction = -cameras[c].viewmat.linear.row[2];
    if (const Status s = draw(cameras[c], headlight, f); !s) {
      std::fprintf(stderr, "gsnav-render: camera %zu: %s\n", c, s.message().c_str());
      return 1;
    }
    const auto end = std::chrono::steady_clock::now();
    total_ms += std::chrono::duration<double, std::milli>(end - start).count();
    if (o.ledger) {
      host.look(cameras[c]);
      const FrameLedger ledger = host.ledger(cameras[c], f.stats[0], scene.opened.report);
      std::printf("camera %zu:\n%s", c, ledger_text(ledger).c_str());
    }
    if (const Status s = write_images(f, cameras[c], c, o); !s.ok()) return fail(s.message());
    if (terminal || c + 1 == cameras.size()) {
      std::printf("%s%zu/%zu views, %.1f ms per view", terminal ? "\r" : "", c + 1, cameras.size(),
                  total_ms / static_cast<double>(c + 1));
      std::fflush(stdout);
    }
  }
  std::printf("\n");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Options o;
  if (const auto status = gsnav_render::parse_options(argc, argv, o)) return *status;
  if (Status s = make_room(o, true); !s) return fail(s.message());
  const auto scene = gsnav_render::load_scene(o);
  if (!scene) return fail(scene.message());
  if (scene->cameras.empty())
    return fail(o.scene + " has nothing that views could surround: choose views by --cameras or --eye");
  if (o.ledger && scene->opened.scene->assets.empty())
    return fail("--ledger: " + o.scene + " has no Gaussians");
  if (Status s = make_room(o, false); !s) return fail(s.message());
  const RenderOptions how = how_to_draw(o, scene->opened);
  HostView host(scene->opened.scene, how);
  if (o.float64) {
    return run<double>(o, *scene, host, [&](const Camera& camera, const MeshLight& light, auto& frames) {
      return host.render(camera, light, frames);
    });
  }
  auto renderer = Renderer::create(o.device, scene->opened.scene, how);
  if (!renderer) return fail(renderer.message());
  return run<float>(o, *scene, host, [&](const Camera& camera, const MeshLight& light, auto& frames) {
    if (Status s = renderer->set_light(light); !s) return s;
    return renderer->render(std::span(&camera, 1), frames);
  });
}
