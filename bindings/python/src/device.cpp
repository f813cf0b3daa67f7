// SPDX-License-Identifier: Apache-2.0
#include "gsnav/device/device.hpp"

#include <nanobind/operators.h>
#include <nanobind/stl/string.h>

#include <functional>

#include "bind.hpp"
#include "list_casters.hpp"

namespace gsnav::python {

void bind_device(nb::module_& m) {
  nb::enum_<DeviceKind>(m, "DeviceKind", "Kind of hardware that a program computes on.")
      .value("serial", DeviceKind::serial, "One thread of portable code: the reference.")
      .value("cpu", DeviceKind::cpu, "All CPU cores and SIMD lanes.")
      .value("cuda", DeviceKind::cuda, "An NVIDIA GPU, in a package that was built with GSNAV_CUDA=ON.");

  nb::class_<Device>(
      m, "Device",
      "Hardware that renderers and simulators run on. It is a value that names hardware and "
      "holds no resources. Functions with a parameter `device` also take the name.")
      .def(nb::init<>(), "The serial device.")
      .def_static(
          "parse", [](const std::string& text) { return Device::parse(text).value(); }, nb::arg("text"),
          "Parses the name of a device: \"best\", \"cpu\", \"cpu:4\" (four threads), \"cuda\", "
          "\"cuda:1\" or \"serial\".\n\n"
          "Raises InvalidArgument for any other text, and Unsupported if this machine has no such "
          "device.")
      .def_static("available", &Device::available,
                  "Names of all devices of this machine, slowest kind first.")
      .def_prop_ro("kind", &Device::kind, "Kind of hardware.")
      .def_prop_ro("threads", &Device::threads, "Number of CPU threads; 0 is the default of OpenMP.")
      .def_prop_ro("index", &Device::index, "Index of the GPU.")
      .def_prop_ro("name", &Device::name, "Name in the form that `parse` accepts.")
      .def_prop_ro("description", &Device::description, "Description for people.")
      .def(
          "__eq__", [](const Device& a, const Device& b) { return a == b; }, nb::is_operator(),
          nb::sig("def __eq__(self, other: object, /) -> bool"))
      .def("__hash__", [](const Device& d) { return std::hash<std::string>()(d.name()); })
      .def("__repr__", [](const Device& d) { return "Device.parse('" + d.name() + "')"; })
      .def("__getstate__", [](const Device& d) { return d.name(); })
      .def("__setstate__",
           [](Device& d, const std::string& name) { new (&d) Device(Device::parse(name).value()); });
}

}  // namespace gsnav::python
