// SPDX-License-Identifier: Apache-2.0
#include "avatar_arrays.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "gsnav/detail/math/curves.hpp"
#include "gsnav/frame/sh.hpp"

namespace gsnav::io::detail {
namespace {

/// Names of the arrays that both kinds of file have.
struct ArrayNames {
  const char *means, *scales, *quats, *opacities;
};
constexpr ArrayNames kHabitat{"means", "scales", "quats", "opacities"};
constexpr ArrayNames kGart{"_xyz", "_scaling", "_rotation", "_opacity"};

class AvatarArrayReader {
 public:
  AvatarArrayReader(const NpzArrays& arrays, std::size_t joints) : arrays_(arrays), joints_(joints) {}

  Status read_habitat(AvatarColors colors, std::vector<std::string>& warnings) {
    if (Status s = read_common(kHabitat); !s) return s;
    if (Status s = check_ranges(); !s) return s;
    return read_sh(colors, warnings);
  }

  /// Reads GART's parameters, which are stored before their activations.
  Status read_gart() {
    if (Status s = read_common(kGart); !s) return s;
    if (Status s = activate(); !s) return s;
    if (Status s = check_ranges(); !s) return s;
    return read_features();
  }

  AvatarFileArrays out;

 private:
  Status error(Errc code, const std::string& what) const {
    return {code, arrays_.file().source() + ": " + what};
  }
  Status bad(const std::string& what) const { return error(Errc::invalid_file, what); }

  Status read(NpyArray& to, const char* name, const std::vector<std::size_t>& shape) const {
    auto a = arrays_.read(name, shape);
    if (a) to = std::move(*a);
    return a.status();
  }

  Status read_common(const ArrayNames& names) {
    if (Status s = read(out.means, names.means, {NpzArrays::kAny, 3}); !s) return s;
    const std::size_t n = out.count = out.means.shape[0];
    if (n == 0) return bad(std::string(names.means) + " has no Gaussians");
    if (Status s = read(out.scales, names.scales, {n, 3}); !s) return s;
    if (Status s = read(out.quats, names.quats, {n, 4}); !s) return s;
    if (Status s = read(out.opacities, names.opacities, {n, 1}); !s) return s;
    return read(out.weights, "lbs_weights", {n, joints_});
  }

  Status activate() {
    double limits[2] = {0.0, 0.1};
    for (std::size_t k = 0; k < 2; ++k) {
      const char* const key = k == 0 ? "min_scale" : "max_scale";
      if (!arrays_.file().contains(key)) continue;
      const auto v = arrays_.number(key);
      if (!v) return v.status();
      limits[k] = *v;
    }
    for (double& v : out.scales.values) v = limits[0] + sigmoid(v) * (limits[1] - limits[0]);
    for (double& v : out.opacities.values) v = sigmoid(v);
    // Weights are trilinear samples plus corrections, which may make them slightly negative.
    for (double& v : out.weights.values) v = std::max(v, 0.0);
    return {};
  }

  Status check_ranges() const {
    for (const auto& [array, name, most] :
         {std::tuple{&out.scales, "scales", HUGE_VAL}, std::tuple{&out.opacities, "opacities", 1.0},
          std::tuple{&out.weights, "lbs_weights", HUGE_VAL}}) {
      const std::size_t row = array->values.size() / out.count;
      for (std::size_t i = 0; i < array->values.size(); ++i) {
        const double v = array->values[i];
        if (v >= 0 && v <= most) continue;
        return bad(std::string(name) + ": row " + std::to_string(i / row) + " has " + std::to_string(v));
      }
    }
    return {};
  }

  Status read_sh(AvatarColors colors, std::vector<std::string>& warnings) {
    if (Status s = read(out.shs, "shs", {}); !s) return s;
    const auto& shape = out.shs.shape;
    const std::size_t k = shape.size() == 2 ? 1 : shape.size() == 3 ? shape[1] : 0;
    if (k == 0 || shape[0] != out.count || shape.back() != 3) {
      return bad("shs has the shape " + shape_text(shape) + ", must be [" + std::to_string(out.count) +
                 ", 3] or [" + std::to_string(out.count) + ", K, 3]");
    }
    out.shs.shape = {out.count, k, 3};
    if (Status s = find_degree("shs has"); !s) return s;
    if (k != 1 || colors == AvatarColors::coefficients) return {};
    std::vector<double>& values = out.shs.values;
    if (colors == AvatarColors::guess) {
      const auto in_range = [](double v) { return v >= 0 && v <= 1; };
      if (!std::all_of(values.begin(), values.end(), in_range)) return {};
      warnings.push_back("shs: all values lie in [0, 1] and were taken as RGB");
    }
    for (double& v : values) v = sh0_of_color(v);
    return {};
  }

  /// Reads GART's coefficients, which are stored in two arrays: degree 0, and the others.
  Status read_features() {
    const std::size_t n = out.count;
    NpyArray dc, rest;
    if (Status s = read(dc, "_features_dc", {n, 3}); !s) return s;
    if (arrays_.file().contains("_features_rest")) {
      if (Status s = read(rest, "_features_rest", {}); !s) return s;
      if (rest.values.size() % (3 * n) != 0)
        return bad("_features_rest has the shape " + shape_text(rest.shape));
    }
    const std::size_t more = rest.values.size() / n;
    out.shs.shape = {n, 1 + more / 3, 3};
    const auto append = [&](const std::vector<double>& from, std::size_t row, std::size_t size) {
      const auto first = from.begin() + static_cast<std::ptrdiff_t>(row * size);
      out.shs.values.insert(out.shs.values.end(), first, first + static_cast<std::ptrdiff_t>(size));
    };
    for (std::size_t i = 0; i < n; ++i) {
      append(dc.values, i, 3);
      append(rest.values, i, more);
    }
    return find_degree("_features_dc and _features_rest together have");
  }

  /// Finds the degree of `shs`. `arrays_have` begins the message of an error.
  Status find_degree(const char* arrays_have) {
    const std::size_t k = out.shs.shape[1];
    int& degree = out.sh_degree;
    while (static_cast<std::size_t>(sh_coefficient_count(degree)) < k && degree < kMaxShDegree) ++degree;
    if (static_cast<std::size_t>(sh_coefficient_count(degree)) == k) return {};
    return error(Errc::unsupported, std::string(arrays_have) + " " + std::to_string(k) +
                                        " coefficients, must be 1, 4, 9 or 16");
  }

  const NpzArrays& arrays_;
  std::size_t joints_;
};

}  // namespace

Result<AvatarFileArrays> read_avatar_arrays(const NpzArrays& arrays, std::size_t joints,
                                            AvatarColors colors, std::vector<std::string>& warnings) {
  AvatarArrayReader reader(arrays, joints);
  const bool gart = !arrays.file().contains("means") && arrays.file().contains("_xyz");
  if (Status s = gart ? reader.read_gart() : reader.read_habitat(colors, warnings); !s) return s;
  return std::move(reader.out);
}

}  // namespace gsnav::io::detail
