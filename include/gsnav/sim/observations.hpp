// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "gsnav/detail/sim/batch_world.hpp"
#include "gsnav/detail/sim/sensor.hpp"
#include "gsnav/sim/world.hpp"

namespace gsnav {

/// One sensor's image. Valid until the next step or reset of its simulator.
struct Observation {
  std::string_view uuid;
  SensorKind kind = SensorKind::rgb;
  int height = 0, width = 0, channels = 0;
  std::span<const float> data;  ///< [H][W][channels], row 0 on top
};

/// What the agent perceives after a reset or an action, and what that action did.
struct Observations : StepInfo {
  std::span<const Observation> images;  ///< in the sensors' order; empty without rendering
  PointGoal point_goal{};
  double time = 0.0;  ///< seconds on the scene's clock

  /// The image of sensor `uuid`; empty where there is none.
  std::span<const float> operator[](std::string_view uuid) const noexcept {
    for (const Observation& o : images) {
      if (o.uuid == uuid) return o.data;
    }
    return {};
  }
};

/// One sensor's images of all environments, [environments][height][width][channels]. Valid until the
/// next call. interop/dlpack.hpp makes tensors of them, wherever they are.
struct BatchObservation {
  std::string_view uuid;
  SensorKind kind = SensorKind::rgb;
  std::size_t environments = 0;
  int height = 0, width = 0, channels = 0;
  std::span<const float> data;  ///< in host memory; empty where images stay in the backend's
  const float* on_backend =
      nullptr;  ///< there (BatchConfig::images), whole when the call that drew them returns

  /// The image, in host memory, of one environment (of a finished one: by its place in
  /// BatchStep::finished).
  std::span<const float> of(std::size_t environment) const noexcept {
    const std::size_t n = data.size() / environments;
    return data.subspan(environment * n, n);
  }
};

/// What Gymnasium's VectorEnv returns: observations, rewards, terminated, truncated and what else there
/// is to know.
struct BatchStep : BatchInfo {
  std::span<const BatchObservation> images;  ///< in the sensors' order; empty without rendering
  /// The last images of episodes that ended in this step and whose environments were reset in it, a row
  /// for each of `finished`; only with AutoReset::same_step.
  std::span<const BatchObservation> final_images;
};

}  // namespace gsnav
