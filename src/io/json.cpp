// SPDX-License-Identifier: Apache-2.0
#include "json.hpp"

#include <cmath>

#include "file.hpp"
#include "gsnav/detail/core/field_check.hpp"

namespace gsnav::io::detail {
namespace {

/// The offset at which arrays and objects are nested deeper than `most`, or the size of the text. Exact
/// for the part of the text that is valid JSON; the parser refuses the rest.
std::size_t too_deep_at(std::span<const std::byte> text, int most) {
  int depth = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = static_cast<char>(text[i]);
    if (c == '"') {
      for (++i; i < text.size() && text[i] != std::byte{'"'}; ++i)
        i += text[i] == std::byte{'\\'} ? 1 : 0;
    } else if (c == '[' || c == '{') {
      if (++depth > most) return i;
    } else if (c == ']' || c == '}') {
      --depth;
    }
  }
  return text.size();
}

Result<Json> parse(std::span<const std::byte> text, const std::string& source, int depth,
                   const char* advice) {
  if (const std::size_t at = too_deep_at(text, depth); at < text.size()) {
    return {Errc::unsupported, source + ": JSON nested more than " + std::to_string(depth) +
                                   " deep at byte " + std::to_string(at) + advice};
  }
  const char* first = reinterpret_cast<const char*>(text.data());
  try {
    return Json::parse(first, first + text.size());
  } catch (const Json::parse_error& e) {
    return {Errc::invalid_file, source + ": not valid JSON at byte " + std::to_string(e.byte)};
  } catch (const Json::exception&) {
    return {Errc::invalid_file, source + ": JSON with a number out of range"};
  }
}

}  // namespace

Result<Json> load_json(const std::filesystem::path& path, const ReadLimits* limits) {
  const auto file = read_file(path);
  if (!file) return file.status();
  return limits != nullptr ? parse_json(file->span(), path.string(), *limits)
                           : parse_json(file->span(), path.string());
}

Status check_limits(const ReadLimits& limits, const std::string& source) {
  gsnav::detail::FieldCheck check(source + ": ReadLimits::");
  check.in("json_depth", limits.json_depth, 1, 10000).in("inflation", limits.inflation, 1, 1032);
  return check.in("texture_side", limits.texture_side, 1, 65535).status();
}

Result<Json> parse_json(std::span<const std::byte> text, const std::string& source) {
  return parse(text, source, ReadLimits{}.json_depth, "");
}

Result<Json> parse_json(std::span<const std::byte> text, const std::string& source,
                        const ReadLimits& limits) {
  if (Status s = check_limits(limits, source); !s) return s;
  return parse(text, source, limits.json_depth,
               "; raise ReadLimits::json_depth for a file that you trust");
}

std::string shown(const Json& value) {
  return in_quotes(value.is_structured() ? std::string(value.type_name())
                                         : value.dump(-1, ' ', true, Json::error_handler_t::replace));
}

Status must_be(const std::string& what, const Json& value, const char* rule) {
  return {Errc::invalid_file, what + " is " + shown(value) + ", must be " + rule};
}

const Json* member(const Json& object, const char* key) {
  if (!object.is_object()) return nullptr;
  const auto found = object.find(key);
  return found == object.end() ? nullptr : &*found;
}

namespace {

Status missing(const char* key, const std::string& where) {
  return {Errc::invalid_file, where + ": '" + key + "' is missing"};
}

}  // namespace

Result<double> get_number(const Json& object, const char* key, const std::string& where) {
  const Json* value = member(object, key);
  if (value == nullptr) return missing(key, where);
  if (!value->is_number() || !std::isfinite(value->get<double>())) {
    return must_be(where + ": '" + key + "'", *value, "a finite number");
  }
  return value->get<double>();
}

Result<std::int64_t> get_integer(const Json& object, const char* key, std::int64_t low,
                                 std::int64_t high, const std::string& where) {
  const Json* value = member(object, key);
  if (value == nullptr) return missing(key, where);
  // Some writers put a decimal point after every number.
  const double number = value->is_number() ? value->get<double>() : NAN;
  if (!(number >= static_cast<double>(low) && number <= static_cast<double>(high)) ||
      number != std::floor(number)) {
    return {Errc::invalid_file, where + ": '" + key + "' is " + shown(*value) +
                                    ", must be an integer from " + std::to_string(low) + " to " +
                                    std::to_string(high)};
  }
  return static_cast<std::int64_t>(number);
}

Result<std::vector<double>> get_numbers(const Json& object, const char* key, std::size_t size,
                                        const std::string& where) {
  const Json* value = member(object, key);
  if (value == nullptr) return missing(key, where);
  if (!value->is_array() || value->size() != size) {
    const std::string found =
        value->is_array() ? std::to_string(value->size()) + " values" : shown(*value);
    return {Errc::invalid_file,
            where + ": '" + key + "' is " + found + ", must be " + std::to_string(size) + " numbers"};
  }
  std::vector<double> out;
  out.reserve(size);
  for (std::size_t i = 0; i < size; ++i) {
    const Json& item = (*value)[i];
    if (!item.is_number() || !std::isfinite(item.get<double>())) {
      return must_be(where + ": '" + key + "[" + std::to_string(i) + "]'", item, "a finite number");
    }
    out.push_back(item.get<double>());
  }
  return out;
}

Status get_vector(const Json& object, const char* key, const std::string& where, Vec3d& out) {
  const auto v = get_numbers(object, key, 3, where);
  if (!v) return v.status();
  out = {(*v)[0], (*v)[1], (*v)[2]};
  return {};
}

}  // namespace gsnav::io::detail
