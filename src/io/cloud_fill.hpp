// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/detail/core/huge_pages.hpp"
#include "gsnav/detail/core/run_guarded.hpp"
#include "gsnav/detail/core/thread_pool.hpp"
#include "gsnav/detail/scene/needed_bands.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "populate_pages.hpp"
#include "threads.hpp"

namespace gsnav::io::detail {

/// Rows that are read at a time: enough to be worth a call, few enough for the cache.
inline constexpr std::size_t kRowsAtOnce = 1024;

/// Lets SH bands be read separately from the rest of a file, a range of rows at a time. All bands as
/// floats would take several times the memory of a packed cloud. While `out` is null, the file is read
/// without its bands.
struct BandsApart {
  std::size_t least_rows = 1 << 16;     ///< Files with fewer rows are read in one pass.
  int degree = 0;                       ///< Degree of the file if its bands were left out, else 0.
  std::vector<std::uint32_t> left_out;  ///< Rows of the file that are not in the cloud, ascending.
  // For the passes that read bands:
  std::vector<std::uint32_t> places;  ///< For each row of the file, its row in the cloud, or kNowhere.
  std::size_t first = 0, last = 0;    ///< The range of rows in the cloud that is wanted.
  float* out = nullptr;               ///< [last - first][(degree+1)^2 - 1][3].
  static constexpr std::uint32_t kNowhere = 0xffffffff;

  std::size_t numbers() const noexcept { return sh_band_numbers(degree); }
};

/// Writes consecutive rows of a file to the planes of a cloud, by the rules of activate(). Each row is
/// added once.
class CloudSink {
 public:
  CloudSink(GaussianCloud& cloud, std::size_t first, const BandsApart* apart = nullptr)
      : cloud_(cloud), first_(first), at_(first), row_(first), apart_(apart) {
    rest_ = apart != nullptr ? apart->numbers() : sh_band_numbers(cloud.sh_degree);
  }

  /// Adds a row, or counts why it was dropped. Returns whether it was kept.
  bool add(const RawGaussian& raw) {
    const std::size_t row = row_++;
    if (apart_ != nullptr && apart_->out != nullptr) {
      const std::size_t place = apart_->places[row];
      if (place < apart_->first || place >= apart_->last) return false;
      std::copy_n(raw.shN, rest_, apart_->out + rest_ * (place - apart_->first));
      return true;
    }
    ActiveGaussian g;
    const RowFate fate = activate(raw, rest_, g);
    report_.count(fate, g.clamped);
    if (fate != RowFate::kept) {
      if (apart_ != nullptr) left_out_.push_back(static_cast<std::uint32_t>(row));
      return false;
    }
    const std::uint32_t id = lattice_.id_of(g.mean);
    if (id != 0 || !ids_.empty()) {
      ids_.resize(at_ - first_, 0);
      ids_.push_back(id);
    }
    const Vec3d offset = g.mean - lattice_.origins()[id];
    for (std::size_t k = 0; k < 3; ++k) {
      cloud_.means[k][at_] = static_cast<float>(offset[static_cast<int>(k)]);
      cloud_.scales[k][at_] = g.scales[k];
      cloud_.sh0[3 * at_ + k] = raw.sh0[k];
    }
    for (std::size_t k = 0; k < 4; ++k) cloud_.quats[k][at_] = g.quat[k];
    cloud_.opacities[at_] = g.opacity;
    if (apart_ == nullptr) {
      float* const bands = cloud_.shN.data() + rest_ * at_;
      if (raw.shN != bands) std::copy_n(raw.shN, rest_, bands);
    }
    report_.bounds.add(raw.mean);
    ++at_;
    return true;
  }

  /// The SH bands of the file's row i, if fill_cloud was given them.
  float* bands(std::size_t i) const noexcept { return cloud_.shN.data() + rest_ * i; }
  /// The cloud that is filled. Rows that were not yet added have what fill_cloud was given.
  const GaussianCloud& cloud() const noexcept { return cloud_; }

  std::size_t first() const noexcept { return first_; }
  std::size_t size() const noexcept { return at_ - first_; }
  const LoadReport& report() const noexcept { return report_; }

  /// Adds the origins of the rows to `all`, and writes the id of each row's origin to to[at], to[at +
  /// 1], ... Needed only if has_origins().
  void give_origins(OriginLattice& all, std::vector<std::uint32_t>& to, std::size_t at) const {
    std::vector<std::uint32_t> ids;
    for (const Vec3d& origin : lattice_.origins()) ids.push_back(all.id_of_point(origin));
    for (std::size_t i = 0; i < ids_.size(); ++i) to[at + i] = ids[ids_[i]];
  }
  bool has_origins() const noexcept { return !ids_.empty(); }
  const std::vector<std::uint32_t>& left_out() const noexcept { return left_out_; }

 private:
  GaussianCloud& cloud_;
  std::size_t first_, at_, rest_ = 0, row_;
  const BandsApart* apart_;
  std::vector<std::uint32_t> left_out_;
  LoadReport report_;
  OriginLattice lattice_;
  std::vector<std::uint32_t> ids_;  ///< Ids of the rows so far; empty while all are zero.
};

/// Moves n rows of all planes from row `from` to the lower row `to`.
inline void move_rows(GaussianCloud& cloud, std::size_t from, std::size_t to, std::size_t n) {
  if (from == to || n == 0) return;
  const std::size_t rest = 3 * static_cast<std::size_t>(sh_coefficient_count(cloud.sh_degree) - 1);
  const auto plane = [&](std::vector<float>& v, std::size_t stride) {
    std::copy_n(v.data() + stride * from, stride * n, v.data() + stride * to);
  };
  for (auto& v : cloud.means) plane(v, 1);
  for (auto& v : cloud.quats) plane(v, 1);
  for (auto& v : cloud.scales) plane(v, 1);
  plane(cloud.opacities, 1);
  plane(cloud.sh0, 3);
  if (rest != 0) plane(cloud.shN, rest);
}

/// Number of pieces in which `count` rows are read in parallel.
inline std::size_t pieces_of(std::size_t count) noexcept {
  constexpr std::size_t kRowsWorthAThread = 1 << 15;
  return std::clamp(count / kRowsWorthAThread, std::size_t{1}, io_threads());
}

/// Calls f(p, first, last), which returns a Status, in parallel for the rows [first, last) of each piece
/// p. Returns the error of the first piece that fails. Throws std::bad_alloc if a call did.
template <class F>
Status for_pieces(std::size_t count, std::size_t pieces, const F& f) {
  ThreadPool pool(static_cast<int>(pieces));
  const auto piece = [&](std::uint32_t p) { return f(p, count * p / pieces, count * (p + 1) / pieces); };
  Status s = gsnav::detail::run_guarded(pool, static_cast<std::uint32_t>(pieces), piece);
  if (s.code() == Errc::out_of_memory) throw std::bad_alloc();
  return s;
}

/// Resizes the planes of a cloud to `n` rows. All threads touch new memory.
inline void resize_planes(GaussianCloud& cloud, std::size_t n) {
  const std::size_t rest = 3 * static_cast<std::size_t>(sh_coefficient_count(cloud.sh_degree) - 1);
  const auto for_planes = [&](const auto& f) {
    for (auto& v : cloud.means) f(v, n);
    for (auto& v : cloud.quats) f(v, n);
    for (auto& v : cloud.scales) f(v, n);
    f(cloud.opacities, n);
    f(cloud.sh0, 3 * n);
    f(cloud.shN, rest * n);
  };
  struct Piece {
    float* data;
    std::size_t size;
  };
  std::vector<Piece> fresh;
  for_planes([&](std::vector<float>& v, std::size_t size) {
    constexpr std::size_t kPiece = std::size_t{1} << 22;
    if (!v.empty() || size < kPiece) return;
    v.reserve(size);
    advise_huge_pages(v.data(), size * sizeof(float));
    for (std::size_t at = 0; at < size; at += kPiece)
      fresh.push_back({v.data() + at, std::min(kPiece, size - at)});
  });
  for_pieces(fresh.size(), std::min(fresh.size(), io_threads()),
             [&](std::size_t, std::size_t first, std::size_t last) -> Status {
               for (std::size_t k = first; k < last; ++k)
                 populate_pages(fresh[k].data, fresh[k].size * sizeof(float));
               return {};
             })
      .throw_if_error();
  for_planes([](std::vector<float>& v, std::size_t size) {
    if (v.capacity() == 0) {
      v = huge_vector<float>(size);
    } else {
      v.resize(size);
    }
  });
}

/// Reads `count` rows into a cloud of SH degree `degree`, in parallel if there are many. The result does
/// not depend on the number of threads. No memory is allocated besides that of the cloud.
/// @param decode decode(first, last, sink) adds the rows [first, last) to the sink in order and returns
/// a Status. If several calls fail, the first error is returned.
/// @param parallel false: all rows are read by one call.
/// @param planes planes with `count` rows that exist already; they are moved into the cloud. If shN is
/// one of them, the shN of row i is sink.bands(i). In the other planes, `decode` may still read row i
/// (sink.cloud()) until it adds that row or a later one.
/// @param apart reads bands separately: the cloud then has degree 0. If apart->out is not null, only
/// bands are read.
template <class Decode>
Result<LoadedCloud> fill_cloud(std::size_t count, int degree, const std::string& source,
                               const Decode& decode, bool parallel = true, GaussianCloud planes = {},
                               BandsApart* apart = nullptr) {
  LoadedCloud out;
  out.cloud = std::move(planes);
  GaussianCloud& cloud = out.cloud;
  cloud.sh_degree = apart != nullptr ? 0 : degree;
  out.report.sh_degree = degree;
  out.report.source = source;
  const bool bands_alone = apart != nullptr && apart->out != nullptr;
  if (!bands_alone) resize_planes(cloud, count);
  const std::size_t pieces = parallel ? pieces_of(count) : 1;
  std::vector<CloudSink> sinks;
  for (std::size_t p = 0; p < pieces; ++p) sinks.emplace_back(cloud, count * p / pieces, apart);
  const Status decoded =
      for_pieces(count, pieces, [&](std::size_t p, std::size_t first, std::size_t last) -> Status {
        return decode(first, last, sinks[p]);
      });
  if (!decoded) return decoded;
  if (bands_alone) return out;
  std::size_t kept = 0;
  bool far = false;
  for (std::size_t p = 0; p < pieces; ++p) {
    move_rows(cloud, sinks[p].first(), kept, sinks[p].size());
    kept += sinks[p].size();
    far = far || sinks[p].has_origins();
    out.report.add_counts(sinks[p].report());
    if (apart != nullptr)
      apart->left_out.insert(apart->left_out.end(), sinks[p].left_out().begin(),
                             sinks[p].left_out().end());
  }
  resize_planes(cloud, kept);
  if (far) {
    OriginLattice lattice;
    cloud.origin_ids.assign(kept, 0);
    std::size_t at = 0;
    for (const CloudSink& sink : sinks) {
      sink.give_origins(lattice, cloud.origin_ids, at);
      at += sink.size();
    }
    cloud.origins = lattice.origins();
  }
  return out;
}

}  // namespace gsnav::io::detail
