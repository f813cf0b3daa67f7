// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cuda_runtime_api.h"
#include "gsnav_emulated_device.hpp"

namespace gsnav::emulated {

/// A kernel launch. The constructor takes the arguments between <<< and >>>. Kernel arguments are copied
/// before the call returns.
class Launcher {
 public:
  Launcher(const char* name, dim3 grid, dim3 block, std::size_t shared = 0, cudaStream_t stream = nullptr)
      : name_(name), launch_{grid, block, shared, stream} {}

  /// @param kernel Calls the kernel with its arguments, so that template parameters can be deduced from
  /// them.
  template <class Kernel, class... P>
  void operator()(Kernel kernel, const P&... arguments) const {
    if (!accepts(launch_)) return;
    struct Call {
      Kernel kernel;
      std::tuple<std::decay_t<P>...> arguments;
    };
    enqueue(launch_.stream, [call = Call{kernel, {arguments...}}, launch = launch_, name = name_] {
      run_grid(launch, name,
               [](const void* p) {
                 const Call& c = *static_cast<const Call*>(p);
                 std::apply(c.kernel, c.arguments);
               },
               &call);
    });
  }

 private:
  const char* name_;
  Launch launch_;
};

}  // namespace gsnav::emulated

template <class Kernel>
cudaError_t cudaFuncSetAttribute(Kernel*, cudaFuncAttribute attribute, int value) {
  return gsnav::emulated::set_attribute(attribute, value);
}
