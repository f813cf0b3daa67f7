// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/io/read_limits.hpp"

namespace gsnav::io::detail {

using Json = nlohmann::json;

/// Parses JSON text of which nothing is nested more than 64 deep. Errors: invalid_file (the byte at
/// which it stops making sense), unsupported (nested deeper).
Result<Json> parse_json(std::span<const std::byte> text, const std::string& source);

/// The same for readers whose callers set the limits. Error besides: invalid_argument (`limits`).
Result<Json> parse_json(std::span<const std::byte> text, const std::string& source,
                        const ReadLimits& limits);

/// Errors: invalid_argument naming the field of `limits` that is out of its range.
Status check_limits(const ReadLimits& limits, const std::string& source);

/// A value of a file as it is shown in an error message.
std::string shown(const Json& value);

/// invalid_file: "`what` is `value`, must be `rule`".
Status must_be(const std::string& what, const Json& value, const char* rule);

/// Member `key` of `object`, or null where it is none or lacks it.
const Json* member(const Json& object, const char* key);

/// Reads `key` of `object` with messages that begin with `where` ("file: camera 3").
Result<double> get_number(const Json& object, const char* key, const std::string& where);
/// ... an integer in [low, high].
Result<std::int64_t> get_integer(const Json& object, const char* key, std::int64_t low,
                                 std::int64_t high, const std::string& where);
/// ... an array of exactly `size` finite numbers.
Result<std::vector<double>> get_numbers(const Json& object, const char* key, std::size_t size,
                                        const std::string& where);

}  // namespace gsnav::io::detail
