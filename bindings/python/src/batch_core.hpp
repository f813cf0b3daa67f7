// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>

#include "device_array.hpp"
#include "episode_source.hpp"
#include "gsnav/device/simulator.hpp"
#include "guard.hpp"
#include "image_pool.hpp"
#include "image_source.hpp"

namespace gsnav::python {

/// A BatchSimulator that one thread may use at a time.
///
/// Arrays and worlds keep it alive, and not the Python object of the simulator. The episode source may
/// refer to that object, for example through an environment that owns both and the last observations.
/// Python's collector finds such a cycle through the object, but it cannot look into arrays.
struct BatchCore {
  BatchSimulator sim;
  std::shared_ptr<PythonSource> source;
  std::shared_ptr<ImagePool> pool;  ///< Memory for new images, or null (see image_pool).
  std::shared_ptr<PythonImageSource> images;
  std::shared_ptr<Consumers> consumers;
  bool copy = false;   ///< Images are new arrays.
  bool begun = false;  ///< Worlds exist from the first reset on.
  Busy busy;

  BatchCore(BatchSimulator s, std::shared_ptr<PythonSource> e, std::shared_ptr<ImagePool> p,
            std::shared_ptr<PythonImageSource> i, bool c)
      : sim(std::move(s)),
        source(std::move(e)),
        pool(std::move(p)),
        images(std::move(i)),
        consumers(std::make_shared<Consumers>(sim.device().index())),
        copy(c) {}
};

/// The Python object of a BatchCore.
struct PythonBatch {
  std::shared_ptr<BatchCore> core;
  nb::object owner;  ///< What arrays and worlds keep alive: it shares `core`.

  explicit PythonBatch(std::shared_ptr<BatchCore> c)
      : core(std::move(c)),
        owner(nb::capsule(new std::shared_ptr<BatchCore>(core), [](void* p) noexcept {
          delete static_cast<std::shared_ptr<BatchCore>*>(p);
        })) {}
  PythonBatch(const PythonBatch&) = delete;
  PythonBatch& operator=(const PythonBatch&) = delete;
  ~PythonBatch() {
    forget();
    if (core->pool != nullptr) core->pool->close();
  }
  /// Drops the functions, which only calls of this object use.
  void forget() {
    core->source->function = nb::none();
    core->images->function = nb::none();
  }
};

}  // namespace gsnav::python
