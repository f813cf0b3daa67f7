// SPDX-License-Identifier: Apache-2.0
// prototype
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cmath>
#include <vector>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/scene/lod_build.hpp"
#include "gsnav/scene/lod_cut.hpp"
#include "gsnav/scene/renderer.hpp"
#include "workload.hpp"

using namespace gsnav;
static double now() { return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count(); }
static double psnr(const std::vector<float>& a, const std::vector<float>& b) {
  double s = 0;
  for (std::size_t i = 0; i < a.size(); ++i) { const double d = std::min(std::max(a[i], 0.f), 1.f) - std::min(std::max(b[i], 0.f), 1.f); s += d * d; }
  return -10 * std::log10(s / static_cast<double>(a.size()));
}
int main(int argc, char** argv) {
  OpenMPBackend backend;
  const int W = 256, H = 256, K = 4;
  const auto& cloud = gsnav_bench::workload().cloud;
  auto cams = gsnav_bench::sized(W, H);
  if (cams.size() > 12) cams.resize(12);
  double t = now();
  LodSettings ls; if (getenv("SHD")) ls.sh_degree = atoi(getenv("SHD"));
  LodTree tree = build_lod(backend, cloud, ls).value();
  std::printf("N %zu built %.1f s, %zu nodes %.0f MB\n", cloud.size(), (now() - t) / 1000, tree.nodes.size(), tree.bytes() / 1e6);
  for (std::size_t l = 0; l < tree.levels(); ++l) { double e = 0; for (auto i = tree.level_begin[l]; i < tree.level_begin[l+1]; ++i) e += tree.nodes[i].error; std::printf(" L%zu %.4f", l, e / (tree.level_begin[l+1] - tree.level_begin[l])); } std::printf("\n");
  RenderConfig cfg; cfg.outputs = kRgb; 
  Renderer<float, OpenMPBackend> r(backend, cfg);
  std::vector<std::vector<float>> truth;
  for (auto& c : cams) {
    Camera f = c; f.fx *= K; f.fy *= K; f.cx *= K; f.cy *= K; f.width *= K; f.height *= K;
    auto fr = r.render(cloud.set(), f).value();
    std::vector<float> o(W * H * 3);
    for (int y = 0; y < H; ++y) for (int x = 0; x < W; ++x) for (int ch = 0; ch < 3; ++ch) { double s = 0; for (int i = 0; i < K; ++i) for (int j = 0; j < K; ++j) s += fr.rgb[3 * ((y * K + i) * W * K + x * K + j) + ch]; o[3 * (y * W + x) + ch] = float(s / (K * K)); }
    truth.push_back(o);
  }
  cfg.profile = Profile::fast; r.set_config(cfg);
  Frames<float> fr;
  auto bench = [&](const char* name, double tau, int mode) {
    LodCut cut(tree, cloud); LodChoice ch; ch.pixels = tau;
    double mean = 0, worst = 1e9, ms = 0, vis = 0, pairs = 0, sel = 0, best_gain=1e9;
    static std::vector<double> classic;
    if (mode == 0) classic.clear();
    for (std::size_t c = 0; c < cams.size(); ++c) {
      std::vector<GaussianSet> sets;
      if (mode == 0) sets = {cloud.set()};
      if (mode == 1) { auto s = cloud.set(); s.filter = Filter::mip; s.base_eps2d = 0.3f/16; s.eps2d = LodCut::eps2d(ch, 0.3f); if (tau > 0) s.eps2d = tau; sets = {s}; }
      double best = 1e9, bs = 0;
      for (int rep = 0; rep < 5; ++rep) {
        double t0 = now();
        if (mode == 2) { cut.select(cams[c], ch); sets = cut.sets(ch); }
        double t1 = now();
        r.render(sets, std::span(&cams[c], 1), fr).throw_if_error();
        double t2 = now();
        if (t2 - t0 < best) best = t2 - t0, bs = t1 - t0;
      }
      double p = psnr(truth[c], fr.rgb);
      if (mode == 0) classic.push_back(p);
      mean += p; worst = std::min(worst, p); ms += best; sel += bs; vis += fr.stats[0].visible; pairs += fr.stats[0].tile_intersections;
      best_gain = std::min(best_gain, p - classic[c]);
    }
    double n = cams.size();
    std::printf("%-14s tau %.2f  psnr %.2f worst %.2f leastgain %.2f  ms %.2f (sel %.2f) visible %.0f pairs %.0f\n", name, tau, mean / n, worst, best_gain, ms / n, sel / n, vis / n, pairs / n);
  };
  bench("classic", 0, 0);
  bench("compensated", 0, 1);
  bench("compensated", 0.2, 1);
  bench("compensated", 0.3, 1);
  for (double tau : {0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0}) bench("lod", tau, 2);
}
