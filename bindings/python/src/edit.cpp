// SPDX-License-Identifier: Apache-2.0
// Edits of clouds. Each makes a new cloud, because clouds do not change while arrays and scenes share
// them.
#include <nanobind/ndarray.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "bind.hpp"
#include "fields.hpp"
#include "gsnav/scene/prepare.hpp"

namespace gsnav::python {
namespace {

using Cloud = GaussianCloud;
using Shared = std::shared_ptr<const Cloud>;
using Release = nb::call_guard<ReleaseGil>;

void require(bool holds, const std::string& message) {
  if (!holds) Status(Errc::invalid_argument, message).throw_if_error();
}

/// The rows of an edited cloud, along a curve through space again.
Shared sorted(Cloud&& edited, const char* function) {
  require(edited.size() != 0, std::string(function) + ": no Gaussian is left");
  sort_spatially(edited);
  return std::make_shared<const Cloud>(std::move(edited));
}

Shared cropped(const Cloud& cloud, Aabb<double> box) {
  Cloud made = cloud;
  crop(made, box);
  return sorted(std::move(made), "crop");
}

Shared filtered(const Cloud& cloud, nb::handle keep) {
  const nb::object array = numpy_array(keep);
  nb::ndarray<const bool, nb::ndim<1>, nb::device::cpu> rows;
  require(nb::try_cast(array, rows, false) && rows.shape(0) == cloud.size(),
          "filter_rows: keep must be a bool array of shape [" + std::to_string(cloud.size()) + "]");
  const ReleaseGil release;
  Cloud made = cloud;
  std::vector<std::uint8_t> kept(cloud.size());  // Other threads may change the array.
  for (std::size_t i = 0; i < kept.size(); ++i) kept[i] = rows.view()(i) ? 1 : 0;
  filter_rows(made, [&kept](std::size_t i) { return kept[i] != 0; });
  return sorted(std::move(made), "filter_rows");
}

Shared limited(const Cloud& cloud, int degree) {
  require(degree >= 0 && degree <= kMaxShDegree, "limit_sh_degree: degree " + std::to_string(degree) +
                                                     ": must be 0 to " + std::to_string(kMaxShDegree));
  Cloud made = cloud;
  limit_sh_degree(made, degree);
  return std::make_shared<const Cloud>(std::move(made));
}

Shared transformed(const Cloud& cloud, Similarity by) {
  require(is_valid(by), "transform: by must have a unit quaternion, a positive scale and be finite");
  Cloud made = cloud;
  transform(made, by);
  require(is_finite(made), "transform: a Gaussian would be moved or scaled beyond float32");
  return sorted(std::move(made), "transform");
}

Shared appended(const Cloud& cloud, const Cloud& other) {
  Cloud made = cloud;
  append(made, other).throw_if_error();
  return sorted(std::move(made), "append");
}

}  // namespace

void bind_edits(nb::module_& m) {
  const auto cloud = nb::arg("cloud");
  Struct<UpGuess>(m, "UpGuess", "Up axis of a cloud, guessed from its ground.")
      .field("up", &UpGuess::up, "Unit axis of the asset's frame, shape [3]. Zero for an empty cloud.")
      .field("seen", &UpGuess::seen, "True if the ground decided it. Otherwise `up` is the usual axis.")
      .field("confidence", &UpGuess::confidence,
             "0 to 1 if `seen`: how far the axis is ahead of the other axes and of its opposite.")
      .done();
  m.def(
      "guess_up", [](const Cloud& c) { return guess_up(c); }, cloud, Release(),
      "Guesses the up axis of a cloud from its ground: one of +y, -y and +z.");
  m.def(
      "upright", [](const std::string& axis) { return upright(axis).value(); }, nb::arg("axis"),
      "The rotation about the origin that takes an axis to +y: \"x\", \"y\" or \"z\", with an optional "
      "sign. Raises InvalidArgument for another name.");
  m.def("crop", cropped, cloud, nb::arg("box"), Release(),
        "A cloud of the Gaussians whose means lie in the box, borders included. Raises InvalidArgument "
        "if none does.");
  m.def("filter_rows", filtered, cloud, nb::arg("keep").none(),
        nb::sig("def filter_rows(cloud: GaussianCloud, keep: numpy.typing.NDArray[numpy.bool_]) -> "
                "GaussianCloud"),
        "A cloud of the Gaussians for which `keep`, bool [N], is True. Raises InvalidArgument for "
        "another shape or type, or if no Gaussian is left.");
  m.def("limit_sh_degree", limited, cloud, nb::arg("degree"), Release(),
        "A cloud without the SH bands above `degree`, 0 to 3.");
  m.def("transform", transformed, cloud, nb::arg("by"), Release(),
        "A cloud that is rotated, scaled and moved as a rigid body, with its SH bands. Raises "
        "InvalidArgument if `by` is no similarity or moves a Gaussian beyond float32.");
  m.def("append", appended, cloud, nb::arg("other"), Release(),
        "A cloud of the Gaussians of both, for example of two tiles of a scene. Rows of `cloud` come "
        "first in the order of reading. Raises InvalidArgument if filters, sort orders or colour spaces "
        "differ.");
}

}  // namespace gsnav::python
