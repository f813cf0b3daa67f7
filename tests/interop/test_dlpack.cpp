// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <memory>
#include <string>
#include <vector>

#include "gsnav/backends/serial.hpp"
#include "gsnav/interop/dlpack.hpp"

using namespace gsnav;
using namespace gsnav::interop;

TEST_CASE("an image goes out as a tensor over its own memory, and lives as long as the tensor") {
  auto image = std::make_shared<std::vector<float>>(2 * 3 * 4 * 5);
  const std::weak_ptr<std::vector<float>> watched = image;
  float* const data = image->data();
  SerialBackend backend;
  DLManagedTensor* const t = to_dlpack(data, {2, 3, 4, 5}, dlpack_device(backend), std::move(image));
  const DLTensor& d = t->dl_tensor;
  REQUIRE(d.ndim == 4);
  CHECK(d.data == data);
  CHECK(d.byte_offset == 0);
  CHECK(d.device.device_type == kDLCPU);
  CHECK(d.dtype.code == kDLFloat);
  CHECK(d.dtype.bits == 32);
  CHECK(d.dtype.lanes == 1);
  // Element (1, 2, 3, 4) is the last one, wherever shape and strides say it is.
  std::int64_t last = 0, count = 1;
  const std::int64_t index[4] = {1, 2, 3, 4};
  for (int i = 0; i < 4; ++i) {
    CHECK(d.shape[i] == index[i] + 1);
    last += index[i] * d.strides[i];
    count *= d.shape[i];
  }
  CHECK(last == count - 1);
  CHECK_FALSE(watched.expired());
  t->deleter(t);
  CHECK(watched.expired());
}

TEST_CASE("types of tensors") {
  CHECK(dlpack_type<std::uint8_t>().code == kDLUInt);
  CHECK(dlpack_type<std::uint8_t>().bits == 8);
  CHECK(dlpack_type<std::int64_t>().code == kDLInt);
  CHECK(dlpack_type<std::int64_t>().bits == 64);
  CHECK(dlpack_type<double>().bits == 64);
}

TEST_CASE("a learner's tensor is written in place, or refused with the field that is wrong") {
  std::vector<float> values(1 + 6);
  std::int64_t shape[3] = {1, 2, 3}, strides[3] = {77, 3, 1};  // the stride of one row means nothing
  DLTensor t{};
  t.data = values.data();
  t.byte_offset = sizeof(float);
  t.device = {kDLCPU, 0};
  t.dtype = dlpack_type<float>();
  t.ndim = 3;
  t.shape = shape;
  const DLDevice cpu{kDLCPU, 0};
  for (std::int64_t* s : {static_cast<std::int64_t*>(nullptr), strides}) {
    t.strides = s;
    const View<float> view = from_dlpack<float>(t, cpu).value();
    CHECK(view.data == values.data() + 1);
    CHECK(view.size == 6);
  }
  const auto refused = [&](const DLTensor& bad, DLDevice device = {kDLCPU, 0}) {
    const auto r = from_dlpack<float>(bad, device);
    REQUIRE_FALSE(r.ok());
    CHECK(r.status().code() == Errc::invalid_argument);
    return r.status().message();
  };
  const auto names = [](const std::string& message, const char* field) {
    return message.find(field) != std::string::npos;
  };
  CHECK_FALSE(from_dlpack<double>(t, cpu).ok());
  CHECK(names(refused(t, {kDLCUDA, 0}), "DLTensor.device"));
  DLTensor bad = t;
  bad.dtype.bits = 16;
  CHECK(names(refused(bad), "DLTensor.dtype"));
  std::int64_t transposed[3] = {6, 1, 2};
  bad = t;
  bad.strides = transposed;
  CHECK(names(refused(bad), "DLTensor.strides[2]"));
  std::int64_t negative[3] = {1, -2, 3}, huge[3] = {std::int64_t{1} << 40, std::int64_t{1} << 40, 3};
  bad = t;
  bad.strides = nullptr;
  bad.shape = negative;
  CHECK(names(refused(bad), "DLTensor.shape[1]"));
  bad.shape = huge;
  CHECK(names(refused(bad), "DLTensor.shape is too large"));
  bad = t;
  bad.data = nullptr;
  CHECK(names(refused(bad), "DLTensor.data"));
  bad = t;
  bad.byte_offset = 2;
  CHECK(names(refused(bad), "aligned"));
  // A scalar, and nothing at all.
  bad = t;
  bad.ndim = 0;
  CHECK(from_dlpack<float>(bad, cpu).value().size == 1);
  std::int64_t none[3] = {0, 2, 3};
  bad = t;
  bad.shape = none;
  bad.strides = nullptr;
  bad.data = nullptr;
  CHECK(from_dlpack<float>(bad, cpu).value().size == 0);
}
