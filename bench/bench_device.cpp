// SPDX-License-Identifier: Apache-2.0
// What choosing the device at run time costs: frames of the embedded flat by Renderer and by
// BasicRenderer, whose backend the compiler knows, in turn. usage: bench_device [side [pairs [threads]]]
//
// A row: the medians of both in processor time, and the median of the differences of neighbours, as a
// share of a frame. The row "template twice" has the same renderer on both sides:
// differences there are noise.
#include <time.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string>
#include <vector>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/demo.hpp"
#include "gsnav/device/renderer.hpp"
#include "gsnav/scene/basic_renderer.hpp"

namespace {

using namespace gsnav;

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Processor time of the process: other programs take none of it.
double now_ms() {
  timespec t{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

template <class Draw>
double ms_of(const Draw& draw, const Camera& camera) {
  const double from = now_ms();
  draw(camera);
  return now_ms() - from;
}

/// Draws pairs of frames, each from the next camera; which of a pair is first alternates.
template <class A, class B>
void row(const char* name, const std::vector<Camera>& cameras, int pairs, const A& a, const B& b) {
  for (const Camera& c : cameras) a(c), b(c);
  std::vector<double> first, second, share;
  for (int i = 0; i < pairs; ++i) {
    const Camera& camera = cameras[static_cast<std::size_t>(i / 2) % cameras.size()];
    double ta = 0, tb = 0;
    if (i % 2 == 0) {
      ta = ms_of(a, camera), tb = ms_of(b, camera);
    } else {
      tb = ms_of(b, camera), ta = ms_of(a, camera);
    }
    first.push_back(ta), second.push_back(tb), share.push_back((tb - ta) / ta);
  }
  std::printf("| %s | %.4f | %.4f | %+.2f %% |\n", name, median(first), median(second),
              100 * median(share));
}

int run(int side, int pairs, int threads) {
  const auto device = Device::parse("cpu:" + std::to_string(threads)).value();
  const GaussianCloud cloud = make_default_scene().value().cloud;
  std::vector<Camera> cameras;
  for (const DefaultView& v : default_scene_views())
    cameras.push_back(Camera::look_at(v.eye, v.target, {0, 1, 0}, side, side, 90));

  OpenMPBackend backend(threads);
  BasicRenderer<float, OpenMPBackend> known(backend);
  const GaussianSet set = cloud.set();
  auto chosen = Renderer::create(device, cloud).value();
  Frames<float> frames, others;
  const auto by_template = [&](const Camera& c) {
    known.render(std::span(&set, 1), std::span(&c, 1), frames).throw_if_error();
  };
  const auto by_device = [&](const Camera& c) {
    chosen.render(std::span(&c, 1), others).throw_if_error();
  };
  std::printf("embedded flat, %zu Gaussians, %d x %d, %d pairs; %s\n", cloud.size(), side, side, pairs,
              device.description().c_str());
  std::printf("| | ms | ms | second to first |\n|---|---|---|---|\n");
  row("template twice", cameras, pairs, by_template, by_template);
  row("template, device", cameras, pairs, by_template, by_device);
  return frames.rgb == others.rgb ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  const auto number = [&](int at, int otherwise) { return argc > at ? std::atoi(argv[at]) : otherwise; };
  const int side = number(1, 64), pairs = number(2, 2000), threads = number(3, 1);
  if (side < 1 || side > 4096 || pairs < 1 || threads < 1 || threads > 1024) {
    std::fprintf(stderr, "usage: bench_device [side [pairs [threads]]]\n");
    return 2;
  }
  return run(side, pairs, threads);
}
