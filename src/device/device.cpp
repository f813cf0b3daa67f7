// SPDX-License-Identifier: Apache-2.0
#include "gsnav/device/device.hpp"

#include <charconv>
#include <optional>

#include "engines.hpp"
#include "gsnav/detail/core/guarded.hpp"
#include "gsnav/detail/core/instruction_set.hpp"

namespace gsnav {
namespace {

#if defined(GSNAV_DEVICE_OPENMP)
constexpr bool kHasCpu = true;
#else
constexpr bool kHasCpu = false;
#endif

int gpu_count() noexcept {
#if defined(GSNAV_DEVICE_CUDA)
  return detail::cuda_count();
#else
  return 0;
#endif
}

/// Text for errors: `; there are: serial cpu cuda:0`.
std::string there_are() {
  std::string text = "; there are:";
  for (const std::string& name : Device::available()) text += " " + name;
#if !defined(GSNAV_DEVICE_CUDA)
  text += " (built without CUDA)";
#endif
  return text;
}

/// The number after "cpu:" or "cuda:", if it is one in [low, high].
std::optional<int> number_in(std::string_view text, int low, int high) {
  int n = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), n);
  if (error != std::errc() || end != text.data() + text.size() || n < low || n > high) return {};
  return n;
}

}  // namespace

Result<Device> Device::parse(std::string_view text) {
  constexpr int kMostThreads = 4096;
  const std::string quoted = "device \"" + std::string(text) + "\"";
  const std::size_t colon = text.find(':');
  const std::string_view kind = text.substr(0, colon);
  const std::optional<std::string_view> number =
      colon == std::string_view::npos ? std::nullopt : std::optional(text.substr(colon + 1));

  if (kind == "best" || kind == "cpu") {
    if (Status s = detail::check_instruction_set(); !s) return s;
  }
  if (kind == "best" && !number) {
    if (gpu_count() > 0) return Device(DeviceKind::cuda, 0, 0);
    return kHasCpu ? Device(DeviceKind::cpu, 0, 0) : Device();
  }
  if (kind == "serial" && !number) return Device();
  if (kind == "cpu") {
    const auto threads = number ? number_in(*number, 1, kMostThreads) : std::optional(0);
    if (!threads)
      return {Errc::invalid_argument, quoted + ": the number of threads must be in [1, 4096]"};
    if (!kHasCpu) return {Errc::unsupported, quoted + ": built without OpenMP" + there_are()};
    return Device(DeviceKind::cpu, *threads, 0);
  }
  if (kind == "cuda") {
    const auto index = number ? number_in(*number, 0, kMostThreads) : std::optional(0);
    if (!index) return {Errc::invalid_argument, quoted + ": the number of a GPU must be 0 or more"};
    if (*index >= gpu_count()) return {Errc::unsupported, quoted + ": no such GPU" + there_are()};
    return Device(DeviceKind::cuda, 0, *index);
  }
  return {Errc::invalid_argument,
          quoted + ": must be best, cpu, cpu:THREADS, cuda, cuda:NUMBER or serial" + there_are()};
}

std::vector<std::string> Device::available() {
  std::vector<std::string> names{"serial"};
  if (kHasCpu) names.push_back("cpu");
  for (int i = 0; i < gpu_count(); ++i) names.push_back("cuda:" + std::to_string(i));
  return names;
}

std::string Device::name() const {
  switch (kind_) {
    case DeviceKind::serial:
      break;
    case DeviceKind::cpu:
      return threads_ == 0 ? "cpu" : "cpu:" + std::to_string(threads_);
    case DeviceKind::cuda:
      return "cuda:" + std::to_string(index_);
  }
  return "serial";
}

std::string Device::description() const {
  switch (kind_) {
    case DeviceKind::serial:
      break;
    case DeviceKind::cpu: {
#if defined(GSNAV_DEVICE_OPENMP)
      const int n = detail::cpu_threads(threads_);
      return "CPU, " + std::to_string(n) + (n == 1 ? " thread, " : " threads, ") +
             detail::cpu_instruction_set();
#else
      break;
#endif
    }
    case DeviceKind::cuda: {
#if defined(GSNAV_DEVICE_CUDA)
      const Result<std::string> known =
          detail::guarded([this]() -> Result<std::string> { return detail::cuda_name(index_); });
      return (known ? *known : "GPU") + " (" + name() + ")";
#else
      break;
#endif
    }
  }
  return "CPU, 1 thread, portable code";
}

}  // namespace gsnav
