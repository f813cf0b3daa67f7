// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cstdint>
#include <limits>

#include "check_refused.hpp"
#include "gltf_builder.hpp"
#include "gltf_file.hpp"

using namespace gsnav;
using namespace gsnav_test;
using io::detail::GltfFile;

namespace {

/// `use` is called with the file while its bytes are there.
template <class Use>
void with_file(const TestGltf& g, const Use& use) {
  TempFolder folder("gltf_values");
  g.write(folder / "a.glb");
  const auto file = GltfFile::open(folder / "a.glb");
  CAPTURE(file.message());
  REQUIRE(file.ok());
  use(*file);
}

template <class T>
void check_normalized(int component, double greatest) {
  constexpr T low = std::numeric_limits<T>::min(), high = std::numeric_limits<T>::max();
  const std::vector<T> raw{low, 0, 1, high};
  for (const bool normalized : {false, true}) {
    TestGltf g;
    g.add(raw, "SCALAR", component, normalized);
    with_file(g, [&](const GltfFile& file) {
      const auto v = file.numbers(0, "SCALAR").value();
      REQUIRE(v.count == raw.size());
      for (std::size_t i = 0; i < raw.size(); ++i) {
        const double plain = static_cast<double>(raw[i]);
        CHECK(v.values[i] == (normalized ? std::fmax(plain / greatest, -1.0) : plain));
      }
    });
  }
}

/// Four points of which a sparse part replaces two.
TestGltf sparse_points(bool with_view) {
  TestGltf g;
  const std::vector<float> points{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
  g.add(points, "VEC3", 5126);
  g.add(std::vector<std::uint16_t>{1, 3}, "SCALAR", 5123);
  g.add(std::vector<float>{-4, -5, -6, -10, -11, -12}, "VEC3", 5126);
  json& a = g.doc["accessors"][0];
  if (!with_view) a.erase("bufferView");
  a["sparse"] = {{"count", 2},
                 {"indices", {{"bufferView", 1}, {"componentType", 5123}}},
                 {"values", {{"bufferView", 2}}}};
  return g;
}

void check_fails(const TestGltf& g, const std::string& part) {
  with_file(g, [&](const GltfFile& file) {
    check_refused(file.values(0, "VEC3"), Errc::invalid_file, "accessors[0]", part);
  });
}

}  // namespace

TEST_CASE("gltf values: integers become what glTF 2.0, 3.6.2.2 says") {
  check_normalized<std::int8_t>(5120, 127);
  check_normalized<std::uint8_t>(5121, 255);
  check_normalized<std::int16_t>(5122, 32767);
  check_normalized<std::uint16_t>(5123, 65535);
}

TEST_CASE("gltf values: rows lie apart where the view says so, and a matrix has 16") {
  TestGltf g;
  g.add(std::vector<float>{1, 2, 99, 3, 4, 99, 5, 6, 99}, "VEC3", 5126);
  g.doc["accessors"][0]["type"] = "VEC2";
  g.doc["bufferViews"][0]["byteStride"] = 12;
  std::vector<float> matrix(16);
  for (std::size_t k = 0; k < 16; ++k) matrix[k] = static_cast<float>(k);
  g.add(matrix, "MAT4", 5126);
  with_file(g, [&](const GltfFile& file) {
    const auto v = file.numbers(0, "VEC2 VEC3").value();
    CHECK(v.width == 2);
    CHECK(v.values == std::vector<double>{1, 2, 3, 4, 5, 6});
    const auto m = file.numbers(1, "MAT4").value();
    CHECK(m.count == 1);
    for (std::size_t k = 0; k < 16; ++k) CHECK(m.row(0)[k] == static_cast<double>(k));
    CHECK(contains(file.values(1, "VEC3").message(), "'MAT4', must be VEC3"));
    CHECK(contains(file.indices(0).message(), "'VEC2', must be SCALAR"));
  });
}

TEST_CASE("gltf values: a sparse part replaces rows, of zeros where there is nothing else") {
  with_file(sparse_points(true), [](const GltfFile& file) {
    CHECK(file.numbers(0, "VEC3").value().values ==
          std::vector<double>{1, 2, 3, -4, -5, -6, 7, 8, 9, -10, -11, -12});
  });
  with_file(sparse_points(false), [](const GltfFile& file) {
    CHECK(file.numbers(0, "VEC3").value().values ==
          std::vector<double>{0, 0, 0, -4, -5, -6, 0, 0, 0, -10, -11, -12});
  });
}

TEST_CASE("gltf values: a sparse part that makes no sense is named") {
  const auto with = [](auto change) {
    TestGltf g = sparse_points(true);
    change(g.doc["accessors"][0]["sparse"]);
    return g;
  };
  check_fails(with([](json& s) { s["count"] = 5; }), "sparse: 'count' is '5'");
  check_fails(with([](json& s) { s["count"] = 4; }), "sparse: 4 elements");
  check_fails(with([](json& s) { s.erase("values"); }), "lacks indices or values");
  check_fails(with([](json& s) { s["indices"]["componentType"] = 5122; }), "'componentType' is 5122");
  check_fails(with([](json& s) { s["indices"]["bufferView"] = 9; }), "'bufferView' is '9'");
  check_fails(with([](json& s) { s["indices"]["bufferView"] = 0; }),
              "sparse: index 16256 of 4");  // half of 1.0f
  TestGltf huge = sparse_points(false);
  huge.doc["accessors"][0]["count"] = 4000000000u;
  with_file(huge,
            [](const GltfFile& file) { CHECK(file.values(0, "VEC3").code() == Errc::unsupported); });
}
