// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace gsnav_viewer {

/// The viewer's page: HTML that only needs POST /frame.
std::string_view page() noexcept;

}  // namespace gsnav_viewer
