// SPDX-License-Identifier: Apache-2.0
#include "codebook.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <queue>
#include <unordered_set>

namespace gsnav::io::detail {
namespace {

constexpr std::size_t kEntries = 256;
constexpr std::size_t kBins = 4096;

/// The distinct values, sorted; nothing if there are more than 256.
std::vector<float> distinct(std::span<const float> values) {
  std::unordered_set<float> seen;
  for (const float v : values) {
    if (seen.insert(v).second && seen.size() > kEntries) return {};
  }
  std::vector<float> out(seen.begin(), seen.end());
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace

ScalarCodebook::ScalarCodebook(std::span<const float> values) {
  if (values.empty()) return;
  if (const std::vector<float> few = distinct(values); !few.empty()) {
    for (std::size_t k = 0; k < kEntries; ++k) entries_[k] = few[std::min(k, few.size() - 1)];
    return;
  }
  const auto [first, last] = std::minmax_element(values.begin(), values.end());
  const double low = static_cast<double>(*first), range = static_cast<double>(*last) - low;
  std::vector<double> density(kBins, 0.0);
  for (const float v : values) {
    const double at = (static_cast<double>(v) - low) / range * kBins;
    density[std::min(kBins - 1, static_cast<std::size_t>(at))] += 1;
  }
  for (double& d : density) d = std::cbrt(d);
  const double sum = std::accumulate(density.begin(), density.end(), 0.0);
  double below = 0;  // density of the entries so far; the whole is 1
  std::size_t bin = 0;
  const auto share = [&](std::size_t b) { return 0.5 / kBins + 0.5 * density[b] / sum; };
  for (std::size_t k = 0; k < kEntries; ++k) {
    const double wanted = static_cast<double>(k) / (kEntries - 1);
    while (bin + 1 < kBins && below + share(bin) < wanted) below += share(bin++);
    const double inside = std::clamp((wanted - below) / share(bin), 0.0, 1.0);
    entries_[k] = static_cast<float>(low + range * (static_cast<double>(bin) + inside) / kBins);
  }
  entries_.front() = *first;
  entries_.back() = *last;
}

std::uint8_t ScalarCodebook::index(float value) const noexcept {
  const auto above = std::lower_bound(entries_.begin(), entries_.end(), value);
  if (above == entries_.begin()) return 0;
  if (above == entries_.end()) return kEntries - 1;
  const auto below = above - 1;
  return static_cast<std::uint8_t>((value - *below < *above - value ? below : above) - entries_.begin());
}

namespace {

/// The vectors [first, last) of the order.
struct VectorRange {
  double error = 0;  ///< Sum of squares about the mean.
  std::size_t first = 0, last = 0;
  std::size_t axis = 0;  ///< Axis along which it is widest.
  double middle = 0;     ///< Mean along that axis.

  bool operator<(const VectorRange& other) const noexcept {
    return error != other.error ? error < other.error : first > other.first;
  }
};

class Splitter {
 public:
  Splitter(std::span<const float> vectors, std::size_t width)
      : vectors_(vectors), width_(width), mean_(width), spread_(width), order_(vectors.size() / width) {
    std::iota(order_.begin(), order_.end(), std::uint32_t{0});
  }

  VectorPalette run(std::size_t most) {
    VectorPalette out;
    out.labels.resize(order_.size());
    if (order_.empty()) return out;
    std::priority_queue<VectorRange> open;
    std::vector<VectorRange> done;
    open.push(measured(0, order_.size()));
    while (!open.empty()) {
      const VectorRange g = open.top();
      open.pop();
      const std::size_t cut = g.error > 0 && done.size() + open.size() + 1 < most ? split(g) : g.first;
      if (cut == g.first || cut == g.last) {
        done.push_back(g);
        continue;
      }
      open.push(measured(g.first, cut));
      open.push(measured(cut, g.last));
    }
    // Sort groups in the order of the vectors, so that neighbours have similar labels and images
    // compress well.
    std::sort(done.begin(), done.end(),
              [](const VectorRange& a, const VectorRange& b) { return a.first < b.first; });
    out.size = done.size();
    out.entries.reserve(out.size * width_);
    for (std::size_t label = 0; label < done.size(); ++label) {
      measured(done[label].first, done[label].last);
      for (const double m : mean_) out.entries.push_back(static_cast<float>(m));
      for (std::size_t i = done[label].first; i < done[label].last; ++i) {
        out.labels[order_[i]] = static_cast<std::uint32_t>(label);
      }
    }
    return out;
  }

 private:
  const float* vector(std::size_t i) const noexcept { return vectors_.data() + order_[i] * width_; }

  /// Measures a group and leaves its mean in mean_. Sums are of differences to the first vector, so that
  /// identical vectors have an error of exactly zero. They are in double, so that the difference of
  /// squares loses none of the precision of floats.
  VectorRange measured(std::size_t first, std::size_t last) {
    VectorRange g{0, first, last, 0, 0};
    std::fill(mean_.begin(), mean_.end(), 0.0);
    std::fill(spread_.begin(), spread_.end(), 0.0);
    const float* origin = vector(first);
    double *sum = mean_.data(), *squares = spread_.data();
    for (std::size_t i = first + 1; i < last; ++i) {
      const float* v = vector(i);
      for (std::size_t k = 0; k < width_; ++k) {
        const double d = static_cast<double>(v[k] - origin[k]);
        sum[k] += d;
        squares[k] += d * d;
      }
    }
    const double n = static_cast<double>(last - first);
    for (std::size_t k = 0; k < width_; ++k) {
      spread_[k] = std::max(0.0, spread_[k] - mean_[k] * mean_[k] / n);
      mean_[k] = static_cast<double>(origin[k]) + mean_[k] / n;
    }
    g.error = std::accumulate(spread_.begin(), spread_.end(), 0.0);
    g.axis =
        static_cast<std::size_t>(std::max_element(spread_.begin(), spread_.end()) - spread_.begin());
    g.middle = mean_[g.axis];
    return g;
  }

  std::size_t split(const VectorRange& g) {
    const auto begin = order_.begin();
    const auto cut =
        std::stable_partition(begin + static_cast<std::ptrdiff_t>(g.first),
                              begin + static_cast<std::ptrdiff_t>(g.last), [&](std::uint32_t row) {
                                return static_cast<double>(vectors_[row * width_ + g.axis]) < g.middle;
                              });
    return static_cast<std::size_t>(cut - begin);
  }

  std::span<const float> vectors_;
  std::size_t width_;
  std::vector<double> mean_, spread_;
  std::vector<std::uint32_t> order_;
};

}  // namespace

VectorPalette make_palette(std::span<const float> vectors, std::size_t width, std::size_t most) {
  return Splitter(vectors, width).run(most);
}

}  // namespace gsnav::io::detail
