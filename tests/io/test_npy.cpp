// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <string>

#include "allocations.hpp"
#include "gsnav/io/image_file.hpp"
#include "support/data.hpp"
#include "support/files.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

std::string npy(const std::string& dictionary, const std::string& values, char version = 1) {
  std::string out("\x93NUMPY", 6);
  out += version;
  out += '\0';
  put(out, static_cast<std::uint16_t>(dictionary.size()));
  return out + dictionary + values;
}

Result<io::NpyArray> parse_array(const std::string& text) {
  TempFolder folder("npy_parse");
  write_file(folder / "a.npy", text);
  return io::load_npy(folder / "a.npy");
}

}  // namespace

TEST_CASE("npy: the bytes that NumPy itself writes") {
  TempFolder folder("npy");
  const std::vector<float> values = {1, 2, 3, 4, 5, -6.5f};
  const std::vector<std::size_t> shape = {2, 3};
  REQUIRE(io::save_npy(folder / "a.npy", values, shape).ok());
  std::string dictionary = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }";
  dictionary += std::string(128 - 10 - dictionary.size() - 1, ' ') + "\n";
  std::string data;
  for (const float v : values) put(data, v);
  CHECK(read_file(folder / "a.npy") == npy(dictionary, data));
  const io::NpyArray a = io::load_npy(folder / "a.npy").value();
  CHECK(a.shape == shape);
  CHECK_FALSE(a.is_double);
  CHECK(a.values == std::vector<double>{1, 2, 3, 4, 5, -6.5});
}

TEST_CASE("npy: shapes of every rank, doubles") {
  TempFolder folder("npy_rank");
  const std::vector<std::vector<std::size_t>> shapes = {{}, {0}, {7}, {1, 1}, {3, 0, 2}, {2, 3, 4, 5}};
  for (const auto& shape : shapes) {
    std::size_t n = 1;
    for (const std::size_t d : shape) n *= d;
    std::vector<double> values(n);
    for (std::size_t i = 0; i < n; ++i) values[i] = 0.1 * static_cast<double>(i) - 3;
    REQUIRE(io::save_npy(folder / "a.npy", values, shape).ok());
    const std::string text = read_file(folder / "a.npy");
    CHECK((text.size() - 8 * n) % 64 == 0);
    const io::NpyArray a = io::load_npy(folder / "a.npy").value();
    CHECK(a.shape == shape);
    CHECK(a.is_double);
    CHECK(a.values == values);
  }
  const std::vector<double> one(7);
  CHECK(contains(
      [&] {
        REQUIRE(io::save_npy(folder / "a.npy", one, std::vector<std::size_t>{7}).ok());
        return read_file(folder / "a.npy");
      }(),
      "'shape': (7,), }"));
  CHECK(io::save_npy(folder / "b.npy", one, std::vector<std::size_t>{8}).code() ==
        Errc::invalid_argument);
  CHECK_FALSE(std::filesystem::exists(folder / "b.npy"));
  CHECK(contains(io::save_npy(folder / "no/b.npy", one, std::vector<std::size_t>{7}).message(),
                 (folder / "no").string()));
}

TEST_CASE("npy: members in any order, quotes of both kinds") {
  std::string data;
  put(data, 2.5);
  put(data, 3.5);
  for (const char* dictionary :
       {"{'shape':(2,),'descr':'<f8','fortran_order':False}",
        "{\"fortran_order\": False, \"descr\": \"<f8\", \"shape\": (1, 2) }  \n"}) {
    CHECK(parse_array(npy(dictionary, data)).value().values == std::vector<double>{2.5, 3.5});
  }
}

TEST_CASE("npy: anything else is an error") {
  const std::string data(16, '\0');
  const std::string good = "{'descr': '<f8', 'fortran_order': False, 'shape': (2,), }";
  REQUIRE(parse_array(npy(good, data)).ok());
  CHECK(parse_array(npy(good, data + "x")).code() == Errc::invalid_file);
  CHECK(parse_array(npy(good, data.substr(1))).code() == Errc::invalid_file);
  CHECK(parse_array(npy(good, data, 4)).code() == Errc::unsupported);
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string out = good;
    out.replace(out.find(from), from.size(), to);
    return parse_array(npy(out, data)).code();
  };
  CHECK(with("<f8", ">f8") == Errc::unsupported);
  CHECK(with("<f8", "<f4") == Errc::invalid_file);
  CHECK(with("<f8", "|O") == Errc::unsupported);
  CHECK(with("False", "0") == Errc::invalid_file);
  CHECK(with("(2,)", "(-2,)") == Errc::invalid_file);
  CHECK(with("(2,)", "(2,,)") == Errc::invalid_file);
  CHECK(with("(2,)", "2") == Errc::invalid_file);
  CHECK(with("'shape': (2,), ", "") == Errc::invalid_file);
  CHECK(with("'shape'", "'shapes'") == Errc::invalid_file);
  CHECK(with("'shape': (2,)", "'shape': (2,), 'shape': (2,)") == Errc::invalid_file);
  CHECK(with("}", "} x") == Errc::invalid_file);
  CHECK(with("}", "") == Errc::invalid_file);
  reset_largest_allocation();
  CHECK(with("(2,)", "(4294967296, 4294967296, 2)") == Errc::invalid_file);
  CHECK(with("(2,)", "(99999999999999999999,)") == Errc::invalid_file);
  CHECK(with("(2,)", "(2305843009213693954,)") == Errc::invalid_file);  // times 8 it wraps to 16
  CHECK(largest_allocation() < 100000);
  CHECK(io::load_npy("/none/a.npy").code() == Errc::file_not_found);
  const std::string whole = npy(good, data);
  for (std::size_t n = 0; n < whole.size(); ++n) {
    REQUIRE(parse_array(whole.substr(0, n)).code() != Errc::ok);
  }
}

TEST_CASE("npy: real arrays of other types") {
  for (const char* name : {"nav/habitat/van-gogh-room_topdown_binary.npy",
                           "nav/habitat/van-gogh-room_topdown_islands.npy"}) {
    const std::string path = data_file(name);
    if (path.empty()) continue;
    const auto result = io::load_npy(path);
    CAPTURE(result.status().message());
    REQUIRE(result.ok());
    CHECK(result->shape.size() == 2);
    std::size_t whole = 0;
    for (const double v : result->values) whole += v == std::floor(v) ? 1u : 0u;
    CHECK(whole == result->values.size());
    CHECK_FALSE(result->is_double);
  }
}
