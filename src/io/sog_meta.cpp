// SPDX-License-Identifier: Apache-2.0
#include "sog_meta.hpp"

#include <algorithm>

#include "file.hpp"
#include "json.hpp"
#include "quantised.hpp"
#include "zip.hpp"

namespace gsnav::io::detail {
namespace {

constexpr std::int64_t kMostGaussians = std::int64_t{16383} * 16383;  // WebP's largest image
constexpr std::size_t kBytes = 256;
constexpr std::int64_t kLargestPalette = 65536;  // labels have two bytes

/// A parser that keeps the first error, so that reading a field takes one line.
class MetaParser {
 public:
  MetaParser(const Json& json, const std::string& source) : json_(json), source_(source) {}

  Result<SogMeta> run() {
    if (!json_.is_object()) fail("must be an object, is " + shown(json_));
    const Json* version = status_.ok() ? member(json_, "version") : nullptr;
    if (version != nullptr && *version != 2) {
      status_ = {Errc::unsupported,
                 source_ + ": 'version' is " + shown(*version) + ", 1 and 2 are read"};
    }
    const Json* means = section("means");
    const Json* scales = section("scales");
    const Json* quats = section("quats");
    const Json* sh0 = section("sh0");
    if (!status_) return status_;
    range("means", *means, 3, meta_.mins.data(), meta_.maxs.data());
    files("means", *means, {&meta_.means_low, &meta_.means_high});
    files("scales", *scales, {&meta_.scales});
    files("quats", *quats, {&meta_.quats});
    files("sh0", *sh0, {&meta_.sh0});
    if (version != nullptr) {
      version2(*scales, *sh0);
    } else {
      version1(*means, *scales, *sh0);
    }
    if (!status_) return status_;
    return std::move(meta_);
  }

 private:
  void fail(const std::string& what) {
    if (status_.ok()) status_ = {Errc::invalid_file, source_ + ": " + what};
  }
  template <class T>
  bool take(Result<T> from, T& to) {
    if (!from && status_.ok()) status_ = from.status();
    if (from) to = std::move(*from);
    return from.ok();
  }

  const Json* section(const char* name) {
    const Json* s = member(json_, name);
    if (s == nullptr || !s->is_object()) fail(std::string("'") + name + "' is missing or no object");
    return s;
  }

  void range(const std::string& name, const Json& s, std::size_t n, double* mins, double* maxs) {
    std::vector<double> low, high;
    if (!take(get_numbers(s, "mins", n, source_ + ": " + name), low) ||
        !take(get_numbers(s, "maxs", n, source_ + ": " + name), high)) {
      return;
    }
    std::copy(low.begin(), low.end(), mins);
    std::copy(high.begin(), high.end(), maxs);
  }

  void files(const std::string& name, const Json& s, std::initializer_list<std::string*> to) {
    const Json* list = member(s, "files");
    if (list == nullptr || !list->is_array() || list->size() != to.size()) {
      return fail(name + ": 'files' must be " + std::to_string(to.size()) + " names");
    }
    std::size_t i = 0;
    for (std::string* file : to) {
      const Json& item = (*list)[i++];
      if (!item.is_string() || !is_safe_name(item.get<std::string>())) {
        return fail(name + ": 'files' names " + shown(item) + ", must be a file of the same folder");
      }
      *file = item.get<std::string>();
    }
  }

  Codebook codebook(const std::string& name, const Json& s) {
    const Json* book = member(s, "codebook");
    const std::size_t n = book != nullptr && book->is_array() ? book->size() : 0;
    Codebook out;
    if (n == 0 || n > kBytes) {
      fail(name + ": 'codebook' must be 1 to 256 numbers");
    } else {
      take(get_numbers(s, "codebook", n, source_ + ": " + name), out);
    }
    return out;
  }

  void version2(const Json& scales, const Json& sh0) {
    std::int64_t count = 0;
    take(get_integer(json_, "count", 0, kMostGaussians, source_), count);
    meta_.count = static_cast<std::size_t>(count);
    if (const Json* antialias = member(json_, "antialias"); antialias != nullptr) {
      if (!antialias->is_boolean())
        return fail("'antialias' is " + shown(*antialias) + ", must be a boolean");
      meta_.antialias = antialias->get<bool>();
    }
    meta_.log_scales.fill(codebook("scales", scales));
    meta_.dc.fill(codebook("sh0", sh0));
    for (unsigned a = 0; a < kBytes; ++a) meta_.opacity_logits.push_back(opacity_logit(a));
    const Json* rest = member(json_, "shN");
    if (rest == nullptr || rest->is_null()) return;
    std::int64_t bands = 0, palette = 0;
    take(get_integer(*rest, "bands", 1, 3, source_ + ": shN"), bands);
    take(get_integer(*rest, "count", 1, kLargestPalette, source_ + ": shN"), palette);
    meta_.degree = static_cast<int>(bands);
    meta_.palette = static_cast<std::size_t>(palette);
    meta_.rest = codebook("shN", *rest);
    files("shN", *rest, {&meta_.centroids, &meta_.labels});
  }

  /// Reads version 1, which has a range for each channel instead of codebooks, and opacity as a logit.
  void version1(const Json& means, const Json& scales, const Json& sh0) {
    if (member(json_, "shN") != nullptr) {
      status_ = {Errc::unsupported, source_ +
                                        ": SOG version 1 with SH bands ('shN') is not read; "
                                        "convert it to version 2"};
      return;
    }
    const Json* shape = member(means, "shape");
    if (shape == nullptr || !shape->is_array() || shape->empty()) {
      return fail("neither 'version' (SOG 2) nor 'means.shape' (SOG 1) is there");
    }
    const Json first = {{"shape[0]", (*shape)[0]}};
    std::int64_t count = 0;
    take(get_integer(first, "shape[0]", 0, kMostGaussians, source_ + ": means"), count);
    meta_.count = static_cast<std::size_t>(count);
    double low[4] = {}, high[4] = {};
    const auto ramp = [&](std::size_t k) {
      Codebook out;
      for (std::size_t a = 0; a < kBytes; ++a) {
        out.push_back(std::lerp(low[k], high[k], static_cast<double>(a) / 255.0));
      }
      return out;
    };
    range("scales", scales, 3, low, high);
    for (std::size_t k = 0; k < 3; ++k) meta_.log_scales[k] = ramp(k);
    range("sh0", sh0, 4, low, high);
    for (std::size_t k = 0; k < 3; ++k) meta_.dc[k] = ramp(k);
    meta_.opacity_logits = ramp(3);
  }

  const Json& json_;
  const std::string& source_;
  SogMeta meta_;
  Status status_;
};

}  // namespace

Result<SogMeta> parse_sog_meta(std::span<const std::byte> text, const std::string& source) {
  const auto json = parse_json(text, source);
  if (!json) return json.status();
  return MetaParser(*json, source).run();
}

}  // namespace gsnav::io::detail
