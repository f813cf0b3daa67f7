// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <string>

#include "check_quantised.hpp"
#include "codebook.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "gsnav/detail/io/sog.hpp"
#include "row_clouds.hpp"
#include "sog_file.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

double range_of(const std::vector<PlyRow>& rows, const std::vector<std::string>& names) {
  double low = 1e9, high = -1e9;
  for (const PlyRow& row : rows) {
    for (const std::string& name : names) {
      low = std::min(low, row.at(name));
      high = std::max(high, row.at(name));
    }
  }
  return high - low;
}

}  // namespace

TEST_CASE("save_sog: every field within the bound that the header states") {
  TempFolder folder("save_sog");
  for (const int rest : {0, 9, 24, 45}) {
    for (const bool bundle : {true, false}) {
      CAPTURE(rest);
      const std::size_t n = 400;
      std::vector<PlyRow> rows = random_rows(n, rest, 61);
      rows[17]["x"] = 20000;  // an outlier takes steps from the others, no more than the bound says
      GaussianCloud cloud = cloud_of(rows, rest);
      cloud.filter = bundle ? Filter::mip : Filter::classic;
      const auto path = folder / (bundle ? "a.sog" : "meta.json");
      REQUIRE(io::save_sog(path, cloud).ok());
      const LoadedCloud loaded = io::load_sog(path).value();
      check_consistent(loaded);
      REQUIRE(loaded.cloud.size() == n);
      CHECK(loaded.cloud.filter == cloud.filter);
      CHECK(loaded.report.warnings.empty());
      std::vector<std::string> bands;
      for (int k = 0; k < rest; ++k) bands.push_back("f_rest_" + std::to_string(k));
      const char* axes[] = {"x", "y", "z"};
      double squeezed_range[3];
      QuantisedBounds b;
      for (std::size_t k = 0; k < 3; ++k) {
        double low = 1e9, high = -1e9;
        for (const PlyRow& row : rows) {
          const double v = row.at(axes[k]), squeezed = std::copysign(std::log1p(std::fabs(v)), v);
          low = std::min(low, squeezed);
          high = std::max(high, squeezed);
        }
        squeezed_range[k] = high - low;
        b.log_scale[k] = range_of(rows, {"scale_0", "scale_1", "scale_2"}) / 255;
        b.colour[k] = range_of(rows, {"f_dc_0", "f_dc_1", "f_dc_2"}) / 255 * 0.2820948;
      }
      b.opacity = 0.5 / 255;
      b.quat = std::sqrt(0.5) / 255;
      b.rest = rest == 0 ? 0 : range_of(rows, bands) / 255;
      for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t k = 0; k < 3; ++k) {
          b.mean[k] = (1 + std::fabs(rows[i].at(axes[k]))) * squeezed_range[k] / 131070 * 1.001;
        }
        check_quantised(loaded.cloud, i, rows[i], rest, b);
      }
    }
  }
}

TEST_CASE("save_sog: a folder has the planes of its last scene, and what else is in it stays") {
  const TempFolder folder("sog_again");
  const std::set<std::string> plain{"meta.json",   "means_l.webp", "means_u.webp",
                                    "scales.webp", "quats.webp",   "sh0.webp"};
  std::set<std::string> banded = plain;
  banded.insert({"shN_centroids.webp", "shN_labels.webp"});
  const auto save = [&](int rest) {
    const GaussianCloud cloud = cloud_of(random_rows(50, rest, 62), rest);
    REQUIRE(io::save_sog(folder / "meta.json", cloud).ok());
    CHECK(io::load_sog(folder / "meta.json").value().cloud.sh_degree == cloud.sh_degree);
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
      // Beside another scene's, images have a number in their names until that scene is gone.
      std::string name = entry.path().filename().string();
      if (const std::size_t number = name.find(".1.webp"); number != std::string::npos)
        name.erase(number, 2);
      CHECK(names.insert(name).second);
    }
    return names;
  };
  CHECK(save(45) == banded);
  CHECK(save(0) == plain);
  CHECK(save(9) == banded);
  write_file(folder / "thumbnail.webp", "mine");
  std::set<std::string> with_mine = plain;
  with_mine.insert("thumbnail.webp");
  CHECK(save(0) == with_mine);
  CHECK(read_file(folder / "thumbnail.webp") == "mine");
  // A bundle beside the folder's files has nothing to do with them.
  CHECK(save(9).size() == banded.size() + 1);
  REQUIRE(io::save_sog(folder / "other.sog", cloud_of(random_rows(5, 0, 63), 0)).ok());
  CHECK(io::load_sog(folder / "meta.json").value().cloud.sh_degree == 1);
  // Nor has a folder that is called like an image: its name is not free, and it stays.
  for (const char* name : {"shN_labels.webp", "shN_labels.1.webp"}) {
    std::filesystem::remove(folder / name);
    std::filesystem::create_directory(folder / name);
  }
  REQUIRE(io::save_sog(folder / "meta.json", cloud_of(random_rows(5, 45, 64), 45)).ok());
  CHECK(io::load_sog(folder / "meta.json").value().cloud.size() == 5);
  CHECK(std::filesystem::is_directory(folder / "shN_labels.webp"));
  CHECK(std::filesystem::is_directory(folder / "shN_labels.1.webp"));
}

TEST_CASE("save_sog: what came out of a SOG goes back without loss") {
  TempFolder folder("save_sog_again");
  SogFile f(3);
  f.make_files();
  f.write_folder(folder / "set");
  const GaussianCloud first = io::load_sog(folder / "set").value().cloud;
  REQUIRE(io::save_sog(folder / "b.sog", first).ok());
  const GaussianCloud second = io::load_sog(folder / "b.sog").value().cloud;
  REQUIRE(second.size() == first.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(near(second.scales[k][i], first.scales[k][i], 1e-6L));
      CHECK(near(second.sh0[3 * i + k], first.sh0[3 * i + k]));
    }
    CHECK(near(second.opacities[i], first.opacities[i]));
  }
  bool same = true;
  for (std::size_t k = 0; k < first.shN.size(); ++k) same = same && near(second.shN[k], first.shN[k]);
  CHECK(same);
}

TEST_CASE("save_sog: flat, opaque, empty, one; and wrong names") {
  TempFolder folder("save_sog_extremes");
  std::vector<PlyRow> rows = random_rows(1, 0, 62);
  rows[0]["scale_1"] = -INFINITY;
  rows[0]["opacity"] = INFINITY;
  REQUIRE(io::save_sog(folder / "a.sog", cloud_of(rows, 0)).ok());
  const GaussianCloud one = io::load_sog(folder / "a.sog").value().cloud;
  REQUIRE(one.size() == 1);
  CHECK(one.opacities[0] == 1.0f);
  CHECK(one.scales[1][0] < 3e-9f);
  CHECK(near(one.mean(0).x, rows[0].at("x"), 1e-12L));
  REQUIRE(io::save_sog(folder / "e.sog", GaussianCloud{}).ok());
  CHECK(io::load_sog(folder / "e.sog").value().cloud.size() == 0);
  CHECK(contains(io::save_sog(folder / "a.txt", one).message(), "a.txt: a SOG is"));
  CHECK(io::save_sog(folder / "none/a.sog", one).code() == Errc::file_not_found);
  CHECK(io::save_sog(folder / "none/meta.json", one).code() == Errc::file_not_found);
  GaussianCloud broken = one;
  broken.sh_degree = 2;
  CHECK(io::save_sog(folder / "a.sog", broken).code() == Errc::invalid_argument);
}

TEST_CASE("codebook: few values are kept, many are never farther than 1/255 of their range") {
  std::mt19937 generator(63);
  std::vector<float> few(5000), many(50000);
  for (float& v : few) v = static_cast<float>(generator() % 256) * 0.37f - 4;
  // Nearly all in one thousandth of the range.
  std::normal_distribution<float> normal;
  for (float& v : many) v = normal(generator) * (generator() % 500 == 0 ? 20.0f : 0.02f);
  const io::detail::ScalarCodebook exact(few), spread(many);
  for (const float v : few) REQUIRE(exact.entries()[exact.index(v)] == v);
  const auto [low, high] = std::minmax_element(many.begin(), many.end());
  double squares = 0;
  for (const float v : many) {
    const float got = spread.entries()[spread.index(v)];
    REQUIRE(std::fabs(got - v) <= (*high - *low) / 255);
    for (const float other : spread.entries()) REQUIRE(std::fabs(got - v) <= std::fabs(other - v));
    squares += static_cast<double>((got - v) * (got - v));
  }
  // Even steps over the whole range would have an error of step / sqrt(12).
  const double even = static_cast<double>(*high - *low) / 255 / std::sqrt(12.0);
  CHECK(std::sqrt(squares / 50000) < even / 4);
  CHECK(io::detail::ScalarCodebook(std::vector<float>{}).index(3) == 255);
}

TEST_CASE("palette: groups are means, few vectors are kept, more entries mean less error") {
  std::mt19937 generator(64);
  std::normal_distribution<float> normal;
  const std::size_t n = 3000, width = 9;
  std::vector<float> vectors(n * width);
  for (float& v : vectors) v = normal(generator);
  const auto error_of = [&](const io::detail::VectorPalette& p) {
    double sum = 0;
    for (std::size_t i = 0; i < n; ++i) {
      REQUIRE(p.labels[i] < p.size);
      for (std::size_t k = 0; k < width; ++k) {
        const double d =
            static_cast<double>(vectors[i * width + k] - p.entries[p.labels[i] * width + k]);
        sum += d * d;
      }
    }
    return sum;
  };
  double last = 1e30;
  for (const std::size_t most : {1u, 2u, 16u, 300u, 3000u}) {
    const auto p = io::detail::make_palette(vectors, width, most);
    CHECK(p.size == most);
    CHECK(p.entries.size() == most * width);
    const double error = error_of(p);
    CHECK(error < last);
    last = error;
    // Means leave the sum of all vectors as it was.
    double before = 0, after = 0;
    for (const float v : vectors) before += static_cast<double>(v);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t k = 0; k < width; ++k)
        after += static_cast<double>(p.entries[p.labels[i] * width + k]);
    }
    CHECK(after == doctest::Approx(before).epsilon(1e-4));
  }
  CHECK(last == 0.0);
  // 40 different vectors, each many times.
  for (std::size_t i = 40; i < n; ++i) {
    std::copy_n(vectors.data() + i % 40 * width, width, vectors.data() + i * width);
  }
  const auto p = io::detail::make_palette(vectors, width, 1024);
  CHECK(p.size == 40);
  CHECK(error_of(p) == 0.0);
}
