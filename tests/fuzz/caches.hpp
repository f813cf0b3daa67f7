// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "gsnav/detail/core/pool_backend.hpp"
#include "gsnav/detail/io/lod_file.hpp"
#include "gsnav/detail/io/visible_file.hpp"
#include "gsnav/detail/render/validate_set.hpp"
#include "gsnav/detail/scene/lod_build.hpp"
#include "lod/lod_support.hpp"
#include "support/files.hpp"

// Files that are cached beside a scene. Their checksums would stop every mutation: an input is the file
// itself after a zero, or what the writer is to write.

namespace gsnav_fuzz {

/// Three chunks, the last one not full.
inline const gsnav::GaussianCloud& cached_scene() {
  static const gsnav::GaussianCloud cloud = gsnav_test::small_wall(1, 2 * gsnav::kProjectChunk + 90);
  return cloud;
}

/// Takes values off the front of an input; zeros where it has ended.
class InputValues {
 public:
  explicit InputValues(const std::string& input) : rest_(input) {}
  template <class T>
  T next() {
    T value{};
    copy(&value, sizeof value);
    return value;
  }
  /// As many as are left whole, up to `most`.
  template <class T>
  std::vector<T> array(std::size_t most) {
    std::vector<T> values(std::min(most, (rest_.size() - at_) / sizeof(T)));
    copy(values.data(), values.size() * sizeof(T));
    return values;
  }
  bool empty() const { return at_ == rest_.size(); }

 private:
  void copy(void* to, std::size_t bytes) {
    const std::size_t n = std::min(bytes, rest_.size() - at_);
    if (n != 0) std::memcpy(to, rest_.data() + at_, n);
    at_ += n;
  }
  const std::string& rest_;
  std::size_t at_ = 0;
};

/// Sets as read_visible takes them.
inline std::string visible_input(const gsnav::VisibleSets& v) {
  std::string out(1, '\1');
  const auto put = [&](const auto* values, std::size_t n) {
    out.append(reinterpret_cast<const char*>(values), n * sizeof *values);
  };
  for (const double x : {v.cell, v.focal, v.near_plane, v.near_sigma, v.min_weight}) put(&x, 1);
  const std::uint8_t cells = static_cast<std::uint8_t>(v.cells());
  put(&cells, 1);
  put(v.keys.data(), v.keys.size());
  put(v.ends.data(), v.ends.size());
  put(v.bits.data(), v.bits.size());
  return out;
}

/// What is wrong with what was read, or null.
inline const char* read_visible(const std::string& input) {
  using namespace gsnav;
  static const gsnav_test::TempFolder folder("fuzz_visible");
  const std::filesystem::path path = folder / "a.vis";
  const std::string rest = input.substr(input.empty() ? 0 : 1);
  if (input.empty() || input[0] == '\0') {
    gsnav_test::write_file(path, rest);
  } else {
    InputValues from(rest);
    VisibleSets v;
    for (double* x : {&v.cell, &v.focal, &v.near_plane, &v.near_sigma, &v.min_weight})
      *x = from.next<double>();
    const std::size_t cells = from.next<std::uint8_t>();
    v.keys = from.array<VisibleSets::Key>(cells);
    v.ends = from.array<std::uint64_t>(v.keys.size());
    v.ends.resize(v.keys.size());
    v.bits = from.array<std::uint32_t>(rest.size());
    v.cloud_chunks = cached_scene().view().chunk_count();
    if (!io::save_visible_sets(path, v, cached_scene()).ok()) return "sets that could not be written";
  }
  const auto sets = io::load_visible_sets(path, cached_scene());
  if (!sets) return nullptr;
  const std::size_t size = cached_scene().size(), chunks = cached_scene().view().chunk_count();
  for (std::size_t c = 0; c < sets->cells(); ++c) {
    const Selection view{{}, sets->seen_from(c)};
    if (!seen_may_have(view.seen.size, chunks)) return "a cell with words of nothing";
    std::size_t rows = 0;
    for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
      if (!view.may_be_seen(chunk)) continue;
      for (std::size_t k = 0; k < kSeenRowWords; ++k) {
        std::uint32_t word = view.seen_rows(chunks, chunk).word(k);
        for (std::size_t first = chunk * kProjectChunk + 32 * k; word != 0; word &= word - 1) {
          const std::size_t row = first + static_cast<std::size_t>(std::countr_zero(word));
          if (view.has_seen_rows(chunks) && row >= size) return "a row that the scene does not have";
          rows += row < size ? 1 : 0;
        }
      }
    }
    if (rows != sets->count_seen_rows(c, size)) return "rows that are counted otherwise";
  }
  return nullptr;
}

inline constexpr std::size_t kLodArrays = 14;

/// The arrays of a tree that a file keeps.
template <class F>
void for_each_lod_array(gsnav::LodTree& tree, const F& f) {
  gsnav::GaussianCloud& m = tree.merged;
  f(tree.nodes);
  for (auto& p : m.means) f(p);
  for (auto& p : m.quats) f(p);
  for (auto& p : m.scales) f(p);
  f(m.opacities);
  f(m.sh0);
  f(m.shN);
}

inline const gsnav::LodTree& cached_tree() {
  static const gsnav::LodTree tree = [] {
    gsnav::PoolBackend pool(1);
    return gsnav::build_lod(pool, cached_scene()).value();
  }();
  return tree;
}

/// What is wrong with what was read, or null. An input but for its first byte: values of four bytes,
/// each behind the number of the array and the place in it where it stands in a tree that is right.
inline const char* read_lod(const std::string& input) {
  using namespace gsnav;
  static const gsnav_test::TempFolder folder("fuzz_lod_file");
  const std::filesystem::path path = folder / "a.lod";
  const std::string rest = input.substr(input.empty() ? 0 : 1);
  if (input.empty() || input[0] == '\0') {
    gsnav_test::write_file(path, rest);
  } else {
    LodTree tree = cached_tree();
    InputValues from(rest);
    while (!from.empty()) {
      const std::size_t array = from.next<std::uint8_t>(), place = from.next<std::uint16_t>();
      const auto word = from.next<std::uint32_t>();
      std::size_t n = 0;
      for_each_lod_array(tree, [&](auto& values) {
        const std::size_t words = values.size() * sizeof values[0] / sizeof word;
        if (n++ != array % kLodArrays || words == 0) return;
        std::memcpy(reinterpret_cast<unsigned char*>(values.data()) + place % words * sizeof word, &word,
                    sizeof word);
      });
    }
    if (!io::save_lod(path, tree, cached_scene()).ok()) return "a tree that could not be written";
  }
  const auto tree = io::load_lod(path, cached_scene());
  if (!tree) return nullptr;
  if (!validate(tree->merged.set()).ok()) return "merged Gaussians that are refused";
  if (tree->nodes.size() != cached_tree().nodes.size()) return "nodes of another tree";
  for (const LodNode& n : tree->nodes) {
    bool ok = std::isfinite(n.error) && n.error >= 0 && std::isfinite(n.grain) && n.grain >= 0;
    for (int k = 0; k < 3; ++k) ok = ok && n.reach.low[k] <= n.reach.high[k];
    if (!ok) return "a node out of range";
  }
  return nullptr;
}

}  // namespace gsnav_fuzz
