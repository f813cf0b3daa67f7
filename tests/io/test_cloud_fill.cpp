// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <span>
#include <vector>

#include "allocations.hpp"
#include "check_cloud.hpp"
#include "cloud_fill.hpp"
#include "gsnav/core/rng.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "widen_rows.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Row i of a scene with everything that can become of a row, far places among them.
RawGaussian row_at(std::size_t i) {
  Rng rng(i + 1);
  static const std::vector<float> rest(45, 0.25f);
  RawGaussian raw;
  for (int k = 0; k < 3; ++k) {
    raw.mean[k] = (i % 1000 < 3 ? 5000.0 : 20.0) * (rng.uniform() - 0.5);
    raw.log_scales[k] = -4 + rng.uniform();
  }
  raw.quat = {rng.uniform() + 0.1, rng.uniform(), rng.uniform(), rng.uniform()};
  raw.opacity_logit = 8 * rng.uniform() - 7;
  raw.sh0 = {static_cast<float>(i), 0.5f, 0.25f};
  raw.shN = rest.data();
  if (i % 97 == 0) raw.mean.x = NAN;
  if (i % 89 == 0) raw.quat = {0, 0, 0, 0};
  if (i % 83 == 0) raw.log_scales.y = 30;
  return raw;
}

}  // namespace

TEST_CASE("fill_cloud: what one row after the other gives, whatever the number of pieces") {
  for (const std::size_t n : {std::size_t{0}, std::size_t{1}, std::size_t{300000}}) {
    GaussianCloudBuilder builder(3, "rows");
    for (std::size_t i = 0; i < n; ++i) builder.add(row_at(i));
    const GaussianCloud& want = builder.cloud();
    for (const bool parallel : {false, true}) {
      const LoadedCloud got =
          io::detail::fill_cloud(
              n, 3, "rows",
              [](std::size_t first, std::size_t last, io::detail::CloudSink& sink) -> Status {
                for (std::size_t i = first; i < last; ++i) sink.add(row_at(i));
                return {};
              },
              parallel)
              .value();
      CHECK(got.cloud.means == want.means);
      CHECK(got.cloud.quats == want.quats);
      CHECK(got.cloud.scales == want.scales);
      CHECK(got.cloud.opacities == want.opacities);
      CHECK(got.cloud.sh0 == want.sh0);
      CHECK(got.cloud.shN == want.shN);
      CHECK(got.cloud.origin_ids == want.origin_ids);
      CHECK(got.cloud.origins == want.origins);
      const LoadReport &a = got.report, &b = builder.report();
      CHECK(a.read == n);
      CHECK(a.kept == b.kept);
      CHECK(a.dropped_non_finite == b.dropped_non_finite);
      CHECK(a.dropped_zero_quat == b.dropped_zero_quat);
      CHECK(a.dropped_transparent == b.dropped_transparent);
      CHECK(a.clamped_scales == b.clamped_scales);
      CHECK(a.bounds.low == b.bounds.low);
      CHECK(a.bounds.high == b.bounds.high);
      if (n > 1) {
        CHECK(want.origins.size() > 100);
        CHECK(a.dropped_transparent > 1000);
      }
    }
  }
}

TEST_CASE("fill_cloud: of several errors the first row's; no memory is an exception") {
  const auto failing = [](std::size_t first, std::size_t last, io::detail::CloudSink& sink) -> Status {
    for (std::size_t i = first; i < last; ++i) {
      if (i >= 70000 && i % 10000 == 0) return {Errc::invalid_file, "row " + std::to_string(i)};
      sink.add(row_at(i));
    }
    return {};
  };
  CHECK(io::detail::fill_cloud(300000, 0, "rows", failing).message() == "row 70000");
  const auto greedy = [](std::size_t, std::size_t, io::detail::CloudSink&) -> Status {
    throw std::bad_alloc();
  };
  CHECK_THROWS_AS(static_cast<void>(io::detail::fill_cloud(300000, 0, "rows", greedy)), std::bad_alloc);
}

TEST_CASE("ply: a large file is read piece by piece, to the same cloud as its bytes") {
  TempFolder folder("ply_pieces");
  PlyFile file;
  file.properties = inria_properties(9);
  file.before_header = "element camera 2\nproperty float a\nproperty uchar b\n";
  file.before_rows = "0123456789";
  file.after_header = "element tail 3\nproperty double t\n";
  file.after_rows = std::string(24, 't');
  file.rows = random_rows(500, 9, 95);
  const std::string few = file.text();
  // The same rows again and again.
  const std::size_t start = file.header().size() + 10, size = 500 * 4 * inria_properties(9).size(),
                    times = 300;
  file.count = std::to_string(500 * times);
  std::string text = file.header() + "0123456789";
  for (std::size_t k = 0; k < times; ++k) text += few.substr(start, size);
  text += std::string(24, 't');
  for (const std::string& end : {std::string(), std::string("stray")}) {
    write_file(folder / "a.ply", text + end);
    const LoadedCloud from_bytes = io::parse_ply(bytes_of(text + end), "a.ply").value();
    reset_largest_allocation();
    const LoadedCloud loaded = io::load_ply(folder / "a.ply").value();
    CHECK(largest_allocation() <= 4 * 9 * 500 * times);  // shN, the largest plane, has nine of 26 floats
    CHECK(loaded.report.kept == 500 * times);
    CHECK(loaded.cloud.means == from_bytes.cloud.means);
    CHECK(loaded.cloud.shN == from_bytes.cloud.shN);
    CHECK(loaded.cloud.opacities == from_bytes.cloud.opacities);
    CHECK(loaded.report.warnings == from_bytes.report.warnings);
    CHECK(loaded.report.warnings.size() == (end.empty() ? 0 : 1));
  }
  for (const std::size_t cut : {text.size() - 5, text.size() - 24 - 1, text.size() / 2, start - 3}) {
    write_file(folder / "a.ply", text.substr(0, cut));
    const auto from_bytes = io::parse_ply(bytes_of(text.substr(0, cut)), (folder / "a.ply").string());
    const auto loaded = io::load_ply(folder / "a.ply");
    CHECK(loaded.code() == from_bytes.code());
    CHECK(loaded.message() == from_bytes.message());
    if (loaded) CHECK(loaded->report.warnings == from_bytes->report.warnings);
  }
}

TEST_CASE("widen_rows: bytes at an array's end become its floats, in place") {
  // Strides of every SH degree, degree 4's bytes for the floats of degree 3 among them; few rows and
  // many.
  for (const std::size_t width : {9u, 24u, 45u, 72u}) {
    const std::size_t floats = std::min<std::size_t>(width, 45);
    for (const std::size_t count :
         {std::size_t{0}, std::size_t{1}, std::size_t{2}, std::size_t{7}, std::size_t{140001}}) {
      CAPTURE(width);
      CAPTURE(count);
      std::vector<float> rows(count * floats);
      const std::span<std::byte> packed = io::detail::packed_rows(rows, count * width);
      const auto byte = [&](std::size_t i, std::size_t k) {
        return static_cast<std::byte>((i * 31 + k * 7 + i / 251) & 255);
      };
      for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t k = 0; k < width; ++k) packed[i * width + k] = byte(i, k);
      }
      io::detail::wanted_threads = 4;
      io::detail::widen_rows<72>(rows, count, width, [&](const std::byte* in, float* out) {
        for (std::size_t k = 0; k < floats; ++k)
          out[k] = static_cast<float>(std::to_integer<int>(in[k]));
      });
      io::detail::wanted_threads = 0;
      bool same = true;
      for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t k = 0; k < floats; ++k) {
          same = same && rows[i * floats + k] == static_cast<float>(std::to_integer<int>(byte(i, k)));
        }
      }
      CHECK(same);
    }
  }
}
