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
/// "640x480".
std::string to_string(const ImageSize& size);

/// The judges of an image.
enum class Oracle {
  contract,      ///< float64 in float32-key order: what `exact` rounds
  contract_f64,  ///< float64 in float64 order: what the key's rounding swaps
  photo4,        ///< the contract at 4 times the resolution, box-averaged: the truth of anti-aliasing
  ray,      ///< exact response and order along each pixel's ray: what EWA and centre order approximate
  ray_key,  ///< exact response in the contract's order: what EWA alone approximates
  untruncated,  ///< no alpha cut and no stop: what truncation leaves out
};
std::string_view to_string(Oracle oracle) noexcept;
/// Errors: invalid_argument with the known names.
gsnav::Result<Oracle> parse_oracle(const std::string& name);

/// One way to render one view of a scene, and the judges of the result.
struct Setting {
  std::size_t view = 0;
  ImageSize size{};
  std::string sensor = "rgbd";     ///< rgbd, rgb, depth
  std::string backend = "openmp";  ///< openmp, serial, cuda
  std::string profile = "exact";   ///< exact, fast, lod, visible: fast of a visible set
  std::string knob = "none", knob_value;
  std::vector<Oracle> oracles;
};

/// What the plan is made of; names are checked by the options.
struct PlanOptions {
  std::size_t views = 4;
  std::vector<ImageSize> sizes;
  std::vector<std::string> sensors, backends, profiles, knobs;
  std::vector<Oracle> oracles;
  ImageSize knob_size{256, 256};
  int sh_degree = 3;  ///< of the scene: max_sh_degree above it changes nothing and is left out
  std::vector<std::string> knob_values{};  ///< of the knobs, only these; empty: all
};

/// All settings for one scene: profiles by sensor and backend at every size (other backends than the
/// first as rgbd only), then each knob by itself from `exact`. Settings of one view and size lie
/// together, so that a reference is made once.
std::vector<Setting> plan(const PlanOptions& options);

/// Names of all knobs, in the order of the report.
std::vector<std::string> knob_names();

/// The configuration of a setting. `storage` changes the scene instead (storage.hpp).
gsnav::RenderConfig render_config(const Setting& setting, gsnav::SortOrder order);

}  // namespace gsnav_report
