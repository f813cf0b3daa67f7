// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "plot.hpp"
#include "table.hpp"

namespace gsnav_report {

inline constexpr const char* kDominatedColor = "#b4bcc6";
inline constexpr const char* kGuideColor = "#8a94a3";

/// Colours that colour-blind readers can tell apart (Okabe and Ito 2008), darkened for white paper.
inline constexpr std::array<const char*, 6> kSeriesColors{"#0b6aa8", "#c2540a", "#00805e",
                                                          "#a8478c", "#5b4bb5", "#8a6d00"};
inline constexpr std::array<Marker, 4> kSeriesMarkers{Marker::circle, Marker::square, Marker::diamond,
                                                      Marker::triangle};

/// Assigns a colour and a mark to each name of a page's series, for example to backends.
class Series {
 public:
  explicit Series(const std::vector<Group>& groups) {
    for (const Group& g : groups) names_.push_back(g.name);
  }
  std::string color(const std::string& name) const {
    return kSeriesColors[at(name) % kSeriesColors.size()];
  }
  Marker marker(const std::string& name) const {
    return kSeriesMarkers[at(name) % kSeriesMarkers.size()];
  }
  std::string legend_html() const {
    std::vector<LegendEntry> entries;
    for (const std::string& n : names_)
      entries.push_back({marker(n), color(n), n.empty() ? "reference" : n});
    return legend(entries);
  }

 private:
  std::size_t at(const std::string& name) const {
    std::size_t i = 0;
    while (i < names_.size() && names_[i] != name) ++i;
    return i;
  }
  std::vector<std::string> names_;
};

}  // namespace gsnav_report
