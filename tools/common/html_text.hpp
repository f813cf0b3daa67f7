// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace gsnav_tools {

/// Escapes text for HTML and SVG elements and attributes: & < > " ' become entities. Control characters
/// that XML forbids are dropped.
std::string escape(std::string_view text);

/// Encodes as base64 (RFC 4648).
std::string base64(std::string_view bytes);

/// Formats a number for people: `digits` significant digits, no exponent between 1e-4 and 1e6, "inf" or
/// "-inf", and a dash for a missing value or NaN.
std::string format(std::optional<double> value, int digits = 3);

/// Formats a round number such as a budget or a tick: up to 4 significant digits without trailing zeros.
std::string format_round(double value);

/// Formats a coordinate for SVG: two decimals in every locale.
std::string coordinate(double value);

}  // namespace gsnav_tools
