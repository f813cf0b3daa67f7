// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace gsnav_tools {

/// Text for HTML and SVG, inside elements and attributes: & < > " ' become entities, control characters
/// that XML forbids are dropped.
std::string escape(std::string_view text);

/// RFC 4648.
std::string base64(std::string_view bytes);

/// A number for people: `digits` significant ones, no exponent between 1e-4 and 1e6; "inf" and "-inf"; a
/// dash for nothing and for what is no number.
std::string format(std::optional<double> value, int digits = 3);

/// A number that somebody chose, a budget or a tick: up to 4 significant digits, no zeros behind them.
std::string format_round(double value);

/// A coordinate in SVG: two decimals, in every locale.
std::string coordinate(double value);

}  // namespace gsnav_tools
