// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/render/config.hpp"

namespace gsnav_report {

struct ImageSize {
  int width = 0, height = 0;
  friend bool operator==(const ImageSize&, const ImageSize&) = default;
};
/// The size as text, "640x480".
std::string to_string(const ImageSize& size);

/// Oracles that judge an image.
enum class Oracle {
  contract,      ///< float64 in the order of float32 keys: shows the rounding of `exact`
  contract_f64,  ///< float64 in float64 order: shows the swaps by the key's rounding
  photo4,        ///< the contract at 4 times the resolution, box-averaged: the truth of anti-aliasing
  ray,           ///< exact response and order along each pixel's ray: shows the errors of EWA and of the
                 ///< order by centres
  ray_key,       ///< exact response in the contract's order: shows the error of EWA alone
  untruncated,   ///< no alpha cut and no stop: shows the error of truncation
};
/// Name of an oracle in options and rows.
std::string_view to_string(Oracle oracle) noexcept;
/// The oracle of a name. Errors: invalid_argument with the known names.
gsnav::Result<Oracle> parse_oracle(const std::string& name);

/// One way to render one view of a scene, and the oracles that judge the result.
struct Setting {
  std::size_t view = 0;
  ImageSize size{};
  std::string sensor = "rgbd";     ///< rgbd, rgb, depth
  std::string backend = "openmp";  ///< openmp, serial, cuda
  std::string profile = "exact";   ///< exact, fast, lod, visible (fast with a visible set)
  std::string knob = "none", knob_value;
  std::vector<Oracle> oracles;
};

/// Options of the plan. Names have been checked by the command line.
struct PlanOptions {
  std::size_t views = 4;
  std::vector<ImageSize> sizes;
  std::vector<std::string> sensors, backends, profiles, knobs;
  std::vector<Oracle> oracles;
  ImageSize knob_size{256, 256};
  int sh_degree = 3;  ///< of the scene; values of max_sh_degree above it are left out, since they change
                      ///< nothing
  std::vector<std::string> knob_values{};  ///< only these values of the knobs; empty: all
};

/// All settings for one scene. First come the profiles by sensor and backend at every size; backends
/// after the first have only rgbd. Then comes each knob by itself, starting from `exact`. Settings of
/// one view and size are adjacent, so that each reference is made once.
std::vector<Setting> plan(const PlanOptions& options);

/// Names of all knobs, in the order of the report.
std::vector<std::string> knob_names();
/// Values of all knobs.
std::vector<std::string> knob_values();

/// The render configuration of a setting. The knob `storage` changes the scene instead (storage.hpp).
gsnav::RenderConfig render_config(const Setting& setting, gsnav::SortOrder order);

}  // namespace gsnav_report
