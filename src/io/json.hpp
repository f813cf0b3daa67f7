// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/io/read_limits.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav::io::detail {

using Json = nlohmann::json;

/// Parses JSON that is nested at most 64 deep. Errors: invalid_file with the offset of the first syntax
/// error; unsupported (nested deeper).
Result<Json> parse_json(std::span<const std::byte> text, const std::string& source);

/// Parses JSON within the caller's limits. Errors: as above; invalid_argument (`limits`).
Result<Json> parse_json(std::span<const std::byte> text, const std::string& source,
                        const ReadLimits& limits);

/// Parses a JSON file, within `limits` unless they are null. Errors: those of read_file and parse_json.
Result<Json> load_json(const std::filesystem::path& path, const ReadLimits* limits = nullptr);

/// Checks limits. Error: invalid_argument naming the field that is out of its range.
Status check_limits(const ReadLimits& limits, const std::string& source);

/// A value as text for an error message.
std::string shown(const Json& value);

/// The error invalid_file: "`what` is `value`, must be `rule`".
Status must_be(const std::string& what, const Json& value, const char* rule);

/// Member `key` of `object`. Null if `object` is not an object or has no such member.
const Json* member(const Json& object, const char* key);

/// Reads a finite number. `where` is the start of messages ("file: camera 3").
Result<double> get_number(const Json& object, const char* key, const std::string& where);
/// Reads an integer in [low, high].
Result<std::int64_t> get_integer(const Json& object, const char* key, std::int64_t low,
                                 std::int64_t high, const std::string& where);
/// Reads an array of exactly `size` finite numbers.
Result<std::vector<double>> get_numbers(const Json& object, const char* key, std::size_t size,
                                        const std::string& where);
/// Reads an array of three finite numbers into `out`.
Status get_vector(const Json& object, const char* key, const std::string& where, Vec3d& out);

}  // namespace gsnav::io::detail
