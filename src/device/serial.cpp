// SPDX-License-Identifier: Apache-2.0
#include "gsnav/backends/serial.hpp"

#include "engines_on.hpp"

namespace gsnav::detail {
namespace {

std::unique_ptr<SerialBackend> make_serial(const Device&) { return std::make_unique<SerialBackend>(); }

}  // namespace

const EngineFactory serial_engines = engines_on<SerialBackend, make_serial>();

}  // namespace gsnav::detail
