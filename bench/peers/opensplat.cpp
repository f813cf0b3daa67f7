// SPDX-License-Identifier: Apache-2.0
//
// Times the renderer of OpenSplat for processors, as a baseline of tools/cpu_table.py. Needs a checkout
// of OpenSplat and libtorch; gsnav needs neither of them. docs/benchmarks.md says how to build it.
//
//   CAMERAS=cameras.json [REFERENCE=DIR] opensplat SCENE.ply WIDTH HEIGHT THREADS REPEATS
//
// Prints the median time of a frame over all views, the largest memory of the process, and with
// REFERENCE the PSNR of the worst judged view. REFERENCE has the files NNNN.rgb.npy that `gsnav-render
// --device serial64 --up keep --npy` writes for N views that are evenly spread over the cameras.
//
// A frame takes the steps of OpenSplat's Model::forward, without gradients: activations, projection, SH,
// rasterization and the clamp at 1. OpenSplat's rasterizer reads depths as contiguous memory. With
// libtorch 2.11 they have a stride, so they are copied first. Freeing its lists of Gaussians per pixel
// is not timed.
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "bindings.h"  // of OpenSplat, rasterizer/gsplat-cpu

namespace {

namespace fs = std::filesystem;
using torch::Tensor;
using torch::indexing::Slice;

/// A view of an INRIA cameras.json.
struct View {
  double width = 0, fx = 0, fy = 0;        ///< Width of the image and focal lengths, pixels.
  std::vector<double> position, rotation;  ///< [3] and [3][3], camera to world; z points forward.
};

/// Parameters of the scene as the PLY stores them, before activations.
struct Scene {
  Tensor means, scales, quats, opacities, sh;  ///< [N][3], [N][3], [N][4], [N][1], [N][bands][3].
};

std::string text_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error(path.string() + ": cannot be opened");
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// The first `count` numbers after the next "name" in quotes, searched from `at` on.
std::vector<double> numbers(const std::string& text, const std::string& name, std::size_t count,
                            std::size_t at) {
  at = text.find('"' + name + '"', at);
  if (at == std::string::npos) throw std::runtime_error("a camera has no " + name);
  at += name.size() + 2;
  std::vector<double> out;
  while (out.size() < count) {
    at = text.find_first_of("-0123456789", at);
    if (at == std::string::npos) throw std::runtime_error(name + " of a camera is too short");
    std::size_t used = 0;
    out.push_back(std::stod(text.substr(at, 32), &used));
    at += used;
  }
  return out;
}

std::vector<View> load_views(const fs::path& path) {
  const std::string text = text_of(path);
  std::vector<View> views;
  for (auto at = text.find('{'); at != std::string::npos; at = text.find('{', at + 1)) {
    views.push_back({numbers(text, "width", 1, at)[0], numbers(text, "fx", 1, at)[0],
                     numbers(text, "fy", 1, at)[0], numbers(text, "position", 3, at),
                     numbers(text, "rotation", 9, at)});
  }
  return views;
}

/// Reads a binary little-endian PLY of floats.
Scene load_scene(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::map<std::string, int64_t> columns;
  int64_t rows = 0;
  for (std::string line; std::getline(file, line) && line != "end_header";) {
    std::istringstream words(line);
    std::string first, second, third;
    words >> first >> second >> third;
    if (first == "element") rows = std::stoll(third);
    if (first == "property" && second != "float") throw std::runtime_error(third + " is no float");
    if (first == "property") columns.emplace(third, static_cast<int64_t>(columns.size()));
  }
  const auto width = static_cast<int64_t>(columns.size());
  Tensor all = torch::empty({rows, width});
  const auto bytes = static_cast<std::streamsize>(rows * width * 4);
  if (!file.read(static_cast<char*>(all.data_ptr()), bytes))
    throw std::runtime_error("the PLY is too short");
  const auto pick = [&](std::initializer_list<std::string> names) {
    std::vector<Tensor> out;
    for (const std::string& name : names) out.push_back(all.index({Slice(), columns.at(name)}));
    return torch::stack(out, -1).contiguous();
  };
  int64_t rest = 0;
  while (columns.count("f_rest_" + std::to_string(rest)) != 0) ++rest;
  std::vector<Tensor> sh{pick({"f_dc_0", "f_dc_1", "f_dc_2"})};
  for (int64_t k = 0; k < rest / 3; ++k) {
    const auto name = [&](int64_t c) { return "f_rest_" + std::to_string(c * (rest / 3) + k); };
    sh.push_back(pick({name(0), name(1), name(2)}));
  }
  return {pick({"x", "y", "z"}), pick({"scale_0", "scale_1", "scale_2"}),
          pick({"rot_0", "rot_1", "rot_2", "rot_3"}), pick({"opacity"}),
          torch::stack(sh, 1).contiguous()};
}

/// Draws one image [height][width][3] and puts the milliseconds that it took into `ms`.
Tensor draw(const Scene& scene, const View& view, int width, int height, double& ms) {
  const double scale = width / view.width;  // square pixels, as bench_render
  const auto fx = static_cast<float>(view.fx * scale), fy = static_cast<float>(view.fy * scale);
  const auto begin = std::chrono::steady_clock::now();
  const Tensor eye = torch::tensor(view.position, torch::kFloat32);
  const Tensor rotation = torch::tensor(view.rotation, torch::kFloat32).reshape({3, 3});
  Tensor world_to_camera = torch::eye(4), projection = torch::zeros({4, 4});
  world_to_camera.index_put_({Slice(0, 3), Slice(0, 3)}, rotation.t());
  world_to_camera.index_put_({Slice(0, 3), 3}, -torch::matmul(rotation.t(), eye));
  constexpr float kNear = 0.001f, kFar = 1000;  // of Model::forward
  projection[0][0] = 2 * fx / static_cast<float>(width);
  projection[1][1] = 2 * fy / static_cast<float>(height);
  projection[2][2] = (kFar + kNear) / (kFar - kNear);
  projection[2][3] = -kFar * kNear / (kFar - kNear);
  projection[3][2] = 1;
  projection = torch::matmul(projection, world_to_camera);

  Tensor means = scene.means, scales = torch::exp(scene.scales);
  Tensor quats = scene.quats / scene.quats.norm(2, {-1}, true);
  const auto [xys, radii, conics, cov2d, depths] = project_gaussians_forward_tensor_cpu(
      static_cast<int>(means.size(0)), means, scales, 1, quats, world_to_camera, projection, fx, fy,
      0.5f * static_cast<float>(width), 0.5f * static_cast<float>(height), static_cast<unsigned>(height),
      static_cast<unsigned>(width), 0.01f);
  Tensor directions = means - eye;
  directions = directions / directions.norm(2, {-1}, true);
  const int bands = static_cast<int>(scene.sh.size(1));
  const int degree = bands == 1 ? 0 : bands == 4 ? 1 : bands == 9 ? 2 : 3;
  const Tensor colors =
      torch::clamp_min(compute_sh_forward_tensor_cpu(static_cast<int>(means.size(0)), degree, degree,
                                                     directions, scene.sh) +
                           0.5f,
                       0.0f);
  const auto [image, transmittance, lists] =
      rasterize_forward_tensor_cpu(width, height, xys, conics, colors, torch::sigmoid(scene.opacities),
                                   torch::zeros({3}), cov2d, depths.contiguous());
  Tensor out = torch::clamp_max(image, 1.0f);
  ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  delete[] lists;
  return out;
}

/// PSNR of an image against an NPY file of float32 [height][width][3], dB.
double psnr(const Tensor& image, const fs::path& file) {
  const std::string text = text_of(file);
  const auto bytes = static_cast<std::size_t>(image.numel()) * 4;
  if (text.size() < bytes) throw std::runtime_error(file.string() + ": has another size");
  Tensor truth = torch::empty_like(image);
  std::copy_n(text.data() + (text.size() - bytes), bytes, static_cast<char*>(truth.data_ptr()));
  return -10 * torch::log10((image.to(torch::kFloat64) - truth.to(torch::kFloat64)).pow(2).mean())
                   .item<double>();
}

void run(char** argv) {
  const char* cameras = std::getenv("CAMERAS");
  if (cameras == nullptr) throw std::runtime_error("CAMERAS does not name a cameras.json");
  const int width = std::stoi(argv[2]), height = std::stoi(argv[3]), repeats = std::stoi(argv[5]);
  torch::set_num_threads(std::stoi(argv[4]));
  const torch::NoGradGuard no_gradients;
  const std::vector<View> views = load_views(cameras);
  const Scene scene = load_scene(argv[1]);
  double ms = 0;
  draw(scene, views.at(0), width, height, ms);
  std::vector<double> times;
  for (const View& view : views) {
    for (int i = 0; i < repeats; ++i) {
      draw(scene, view, width, height, ms);
      times.push_back(ms);
    }
  }
  std::nth_element(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2),
                   times.end());
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  std::printf("total %.3f ms\nRSS %ld MB\n", times[times.size() / 2], usage.ru_maxrss / 1024);
  if (const char* folder = std::getenv("REFERENCE"); folder != nullptr) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (entry.path().string().ends_with(".rgb.npy")) files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    double worst = 1e9;
    for (std::size_t i = 0; i < files.size(); ++i) {
      const Tensor image = draw(scene, views.at(i * views.size() / files.size()), width, height, ms);
      worst = std::min(worst, psnr(image, files[i]));
    }
    std::printf("PSNR %.1f dB\n", worst);
  }
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 6) {
    std::fprintf(stderr,
                 "usage: CAMERAS=cameras.json opensplat SCENE.ply WIDTH HEIGHT THREADS REPEATS\n");
    return 2;
  }
  run(argv);
} catch (const std::exception& error) {
  std::fprintf(stderr, "opensplat: %s\n", error.what());
  return 1;
}
