// SPDX-License-Identifier: Apache-2.0
#include "floor.hpp"

#include <algorithm>
#include <map>
#include <vector>

#include "floor_loops.hpp"
#include "frame_stages.hpp"
#include "gsnav/backends/openmp.hpp"

using namespace gsnav;

namespace gsnav_bench {

double clock_ghz() {
  static const double clock = measure_clock();
  return clock;
}

const UnitCosts& measured_costs(int threads) {
  static std::map<int, UnitCosts> cache;
  const auto [entry, added] = cache.try_emplace(threads);
  if (added) {
    const double n = threads;
    UnitCosts& c = entry->second;
    c.bytes_per_ns = measure_bandwidth(threads);
    c.sort_ns = measure_sort_ns(threads);
    c.bin_ns = measure_bin_ns() / n;
    c.mask_ns = measure_mask_ns() / n;
    c.fragment_ns = measure_fragment_ns(true) / n;
    c.transmittance_ns = measure_fragment_ns(false) / n;
  }
  return entry->second;
}

UnitCosts survey_costs(int threads) {
  const double n = threads;
  UnitCosts c;
  c.bytes_per_ns = measured_costs(threads).bytes_per_ns;
  c.sort_ns = threads == 1 ? 5.6 * 2 / 3 : 4.4 / n;
  c.bin_ns = 3.0 / n;
  c.mask_ns = 3.0 / n;
  c.fragment_ns = 13.4 / 16 / clock_ghz() / n;
  c.transmittance_ns = c.fragment_ns;
  return c;
}

UnitCosts least_costs(int threads) {
  const UnitCosts a = survey_costs(threads), &b = measured_costs(threads);
  return {b.bytes_per_ns,
          std::min(a.sort_ns, b.sort_ns),
          std::min(a.bin_ns, b.bin_ns),
          std::min(a.mask_ns, b.mask_ns),
          std::min(a.fragment_ns, b.fragment_ns),
          std::min(a.transmittance_ns, b.transmittance_ns)};
}

FrameWork count_work(const GaussianCloud& cloud, const Camera& camera, const RenderConfig& config) {
  RenderConfig counted = config;
  counted.tuning.tile_size = 16;
  counted.outputs = kAlpha;
  OpenMPBackend backend(1);
  const FrameStages<float, OpenMPBackend> stages(backend, cloud, camera, counted);
  const BinArgs<float>& bins = stages.bins();

  constexpr int kSide = 4;
  const int columns = (camera.width + kSide - 1) / kSide, rows = (camera.height + kSide - 1) / kSide;
  std::vector<float> open(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows) * kSide *
                          kSide);
  for (std::size_t i = 0; i < open.size(); ++i) {
    const int block = static_cast<int>(i / (kSide * kSide)),
              lane = static_cast<int>(i % (kSide * kSide));
    const int x = block % columns * kSide + lane % kSide, y = block / columns * kSide + lane / kSide;
    open[i] = x < camera.width && y < camera.height ? 1.0f : 0.0f;
  }
  const FragmentCounts fragments = count_fragments(bins.order, bins.geometry, bins.bounds,
                                                   blend_rules<float>(counted), open.data(), columns);

  FrameWork work;
  work.color = (config.outputs & kRgb) != 0;
  const int degree = std::min(cloud.sh_degree, config.quality.max_sh_degree);
  work.bytes_per_gaussian = 44 + (work.color ? 6 * sh_coefficient_count(degree) : 0);
  work.visible = static_cast<double>(stages.visible());
  work.pairs = static_cast<double>(stages.pairs());
  work.evaluated = static_cast<double>(fragments.evaluated);
  work.needed = static_cast<double>(fragments.needed);
  work.blended = static_cast<double>(fragments.blended);
  return work;
}

namespace {
double fragment_cost(const FrameWork& work, const UnitCosts& costs) noexcept {
  return work.color ? costs.fragment_ns : costs.transmittance_ns;
}
double read_ns(const FrameWork& work, const UnitCosts& costs) noexcept {
  return work.visible * work.bytes_per_gaussian / costs.bytes_per_ns;
}
double total_ms(const FrameWork& work, const UnitCosts& costs, double lanes) noexcept {
  const double ns = read_ns(work, costs) + work.visible * costs.sort_ns +
                    (work.visible + work.pairs) * costs.bin_ns + work.pairs * costs.mask_ns +
                    lanes * fragment_cost(work, costs);
  return ns * 1e-6;
}
}  // namespace

double floor_ms(const FrameWork& work, int threads) {
  return total_ms(work, survey_costs(threads), work.evaluated);
}

double least_floor_ms(const FrameWork& work, int threads) {
  return total_ms(work, least_costs(threads), work.needed);
}

double hard_floor_ms(const FrameWork& work, int threads) {
  const UnitCosts costs = survey_costs(threads);
  return (read_ns(work, costs) + work.blended * fragment_cost(work, costs)) * 1e-6;
}

}  // namespace gsnav_bench
