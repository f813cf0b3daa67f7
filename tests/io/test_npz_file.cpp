// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "allocations.hpp"
#include "gsnav/detail/io/npz_file.hpp"
#include "zip_file.hpp"

// Archives and arrays are built byte by byte here, from NumPy's and PKWARE's documents.

using namespace gsnav;
using namespace gsnav_test;

namespace {

std::string npy(const std::string& descr, const std::string& shape, const std::string& values,
                bool fortran = false, char version = 1) {
  const std::string dictionary = "{'descr': '" + descr +
                                 "', 'fortran_order': " + (fortran ? "True" : "False") +
                                 ", 'shape': " + shape + ", }\n";
  std::string out("\x93NUMPY", 6);
  out += version;
  out += '\0';
  if (version == 1) {
    put(out, static_cast<std::uint16_t>(dictionary.size()));
  } else {
    put(out, static_cast<std::uint32_t>(dictionary.size()));
  }
  return out + dictionary + values;
}

template <class T>
std::string raw(std::initializer_list<T> values) {
  std::string out;
  for (const T v : values) put(out, v);
  return out;
}

Result<io::NpyArray> read_array(const std::string& content, bool deflated = false) {
  TempFolder folder("npz_array");
  write_file(folder / "a.npz", make_zip({{"x.npy", content, deflated}}));
  const auto file = io::NpzFile::open(folder / "a.npz");
  if (!file) return file.status();
  return file->read("x");
}

/// One stored entry with every size and offset in zip64 fields, as writers of unknown length do.
std::string zip64(const std::string& name, const std::string& content, bool with_extra = true) {
  std::string out, directory, extra;
  const auto crc = static_cast<std::uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(content.data()), static_cast<uInt>(content.size())));
  const auto n = static_cast<std::uint64_t>(content.size());
  const auto common = [&](std::string& to, std::size_t extra_size) {
    put(to, std::uint16_t{45});
    put(to, std::uint16_t{0});
    put(to, std::uint16_t{0});
    put(to, std::uint32_t{0});
    put(to, crc);
    put(to, 0xffffffffu);
    put(to, 0xffffffffu);
    put(to, static_cast<std::uint16_t>(name.size()));
    put(to, static_cast<std::uint16_t>(extra_size));
  };
  put(out, std::uint32_t{0x04034b50});
  common(out, 20);
  out += name;
  put(out, std::uint16_t{1});
  put(out, std::uint16_t{16});
  put(out, n);
  put(out, n);
  out += content;
  put(extra, std::uint16_t{0x7075});  // another field comes first
  put(extra, std::uint16_t{3});
  extra += "abc";
  if (with_extra) {
    put(extra, std::uint16_t{1});
    put(extra, std::uint16_t{24});
    put(extra, n);
    put(extra, n);
    put(extra, std::uint64_t{0});
  }
  put(directory, std::uint32_t{0x02014b50});
  put(directory, std::uint16_t{45});
  common(directory, extra.size());
  for (int k = 0; k < 3; ++k) put(directory, std::uint16_t{0});
  put(directory, std::uint32_t{0});
  put(directory, 0xffffffffu);
  directory += name + extra;
  const std::uint64_t at = out.size(), size = directory.size(), end = at + size;
  out += directory;
  put(out, std::uint32_t{0x06064b50});
  put(out, std::uint64_t{44});
  put(out, std::uint32_t{0x002d002d});
  put(out, std::uint64_t{0});  // volumes
  put(out, std::uint64_t{1});
  put(out, std::uint64_t{1});
  put(out, size);
  put(out, at);
  put(out, std::uint32_t{0x07064b50});
  put(out, std::uint32_t{0});
  put(out, end);
  put(out, std::uint32_t{1});
  put(out, std::uint32_t{0x06054b50});
  put(out, std::uint32_t{0});
  put(out, std::uint16_t{0xffff});
  put(out, std::uint16_t{0xffff});
  put(out, 0xffffffffu);
  put(out, 0xffffffffu);
  put(out, std::uint16_t{0});
  return out;
}

}  // namespace

TEST_CASE("npz: every number type, stored and deflated") {
  using V = std::vector<double>;
  for (const bool deflated : {false, true}) {
    const auto values = [&](const std::string& descr, const std::string& bytes) {
      const auto a = read_array(npy(descr, "(3,)", bytes), deflated);
      CAPTURE(a.status().message());
      REQUIRE(a.ok());
      CHECK(a->descr == descr);
      return a->values;
    };
    CHECK(values("<f4", raw({1.5f, -2.0f, 1e-40f})) == V{1.5, -2.0, double{1e-40f}});
    CHECK(values("<f8", raw({1.5, -0.1, 1e300})) == V{1.5, -0.1, 1e300});
    CHECK(values("|i1", raw<std::int8_t>({1, -128, 127})) == V{1, -128, 127});
    CHECK(values("|u1", raw<std::uint8_t>({1, 128, 255})) == V{1, 128, 255});
    CHECK(values("|b1", raw<std::uint8_t>({1, 0, 1})) == V{1, 0, 1});
    CHECK(values("<i2", raw<std::int16_t>({1, -32768, 7})) == V{1, -32768, 7});
    CHECK(values("<u2", raw<std::uint16_t>({1, 65535, 7})) == V{1, 65535, 7});
    CHECK(values("<i4", raw<std::int32_t>({1, -2147483647, 7})) == V{1, -2147483647, 7});
    CHECK(values("<u4", raw<std::uint32_t>({1, 4294967295u, 7})) == V{1, 4294967295.0, 7});
    CHECK(values("<i8", raw<std::int64_t>({1, -9007199254740991, 7})) == V{1, -9007199254740991.0, 7});
    CHECK(values("<u8", raw<std::uint64_t>({1, 9007199254740991u, 7})) == V{1, 9007199254740991.0, 7});
  }
  const auto big = read_array(npy("<i8", "(1,)", raw<std::int64_t>({9007199254740993})));
  CHECK(big.code() == Errc::unsupported);
  CHECK(contains(big.status().message(), "2^53"));
}

TEST_CASE("npz: float16 at its landmarks") {
  // 1, the largest, the smallest normal and subnormal, minus zero, infinity, NaN.
  const auto a = read_array(
      npy("<f2", "(7,)", raw<std::uint16_t>({0x3c00, 0x7bff, 0x0400, 0x0001, 0x8000, 0xfc00, 0x7e00})));
  REQUIRE(a.ok());
  CHECK(a->values[0] == 1.0);
  CHECK(a->values[1] == 65504.0);
  CHECK(a->values[2] == std::ldexp(1.0, -14));
  CHECK(a->values[3] == std::ldexp(1.0, -24));
  CHECK(std::signbit(a->values[4]));
  CHECK(a->values[4] == 0.0);
  CHECK(a->values[5] == -HUGE_VAL);
  CHECK(std::isnan(a->values[6]));
}

TEST_CASE("npz: Fortran order of any rank is turned to C order") {
  // Element (i, j, k) is 100 i + 10 j + k; a Fortran file counts i up first.
  for (const bool fortran : {false, true}) {
    std::string bytes;
    for (int a = 0; a < 24; ++a) {
      const int i = fortran ? a % 2 : a / 12, j = fortran ? a / 2 % 3 : a / 4 % 3,
                k = fortran ? a / 6 : a % 4;
      put(bytes, static_cast<float>(100 * i + 10 * j + k));
    }
    const auto array = read_array(npy("<f4", "(2, 3, 4)", bytes, fortran));
    REQUIRE(array.ok());
    REQUIRE(array->shape == std::vector<std::size_t>{2, 3, 4});
    for (std::size_t a = 0; a < 24; ++a) {
      CHECK(array->values[a] == static_cast<double>(100 * (a / 12) + 10 * (a / 4 % 3) + a % 4));
    }
  }
  CHECK(read_array(npy("<f4", "(0, 3)", "", true)).value().values.empty());
  CHECK(read_array(npy("<f8", "()", raw({4.5}), true)).value().values == std::vector<double>{4.5});
  for (const char version : {'\2', '\3'}) {
    CHECK(read_array(npy("<f8", "(1,)", raw({4.5}), false, version)).value().values[0] == 4.5);
  }
  CHECK(read_array(npy("<f8", "(1,)", raw({4.5}), false, '\4')).code() == Errc::unsupported);
}

TEST_CASE("npz: zip64 archives") {
  TempFolder folder("npz64");
  const std::string whole = zip64("x.npy", npy("<f8", "(2,)", raw({4.5, 5.5})));
  write_file(folder / "a.npz", whole);
  const auto file = io::NpzFile::open(folder / "a.npz").value();
  CHECK(file.names() == std::vector<std::string>{"x"});
  CHECK(file.read("x").value().values == std::vector<double>{4.5, 5.5});
  write_file(folder / "b.npz", zip64("x.npy", "", false));
  CHECK(contains(io::NpzFile::open(folder / "b.npz").status().message(), "zip64"));
  // Every byte of the zip64 records set to something else: an error or the same array, never a crash.
  for (std::size_t at = 0; at < whole.size(); ++at) {
    for (const int change : {1, 0x80, 0xff}) {
      std::string bad = whole;
      bad[at] = static_cast<char>(bad[at] ^ change);
      write_file(folder / "b.npz", bad);
      reset_largest_allocation();
      const auto opened = io::NpzFile::open(folder / "b.npz");
      const auto array = opened.ok() ? opened->read("x") : Result<io::NpyArray>(opened.status());
      REQUIRE(largest_allocation() < 100000);
      if (!array.ok()) REQUIRE(contains(array.status().message(), "b.npz"));
    }
  }
}

TEST_CASE("npz: sizes are checked before memory is asked for") {
  for (const char* shape : {"(4294967296, 4294967296)", "(1000000000,)", "(2305843009213693954,)"}) {
    reset_largest_allocation();
    CHECK(read_array(npy("<f8", shape, raw({1.0, 2.0}))).code() == Errc::invalid_file);
    CHECK(largest_allocation() < 100000);
  }
  TempFolder folder("npz_bomb");
  ZipFileEntry bomb{"x.npy", "nothing much", true};
  bomb.size = 0xfffffff0;
  write_file(folder / "a.npz", make_zip({bomb}));
  reset_largest_allocation();
  const auto r = io::NpzFile::open(folder / "a.npz").value().read("x");
  CHECK(contains(r.status().message(), "implausible"));
  CHECK(largest_allocation() < 100000);
  // Honest zeros compress a thousand times and are read.
  const auto zeros = read_array(npy("<f8", "(1000, 100)", std::string(800000, '\0')), true);
  CHECK(zeros.value().values.size() == 100000);
}

TEST_CASE("npz: what is no number array is refused by name") {
  for (const char* descr : {"|O", "<U3", ">f4", "<c8", "<f16", "|V4", "<M8[s]"}) {
    const auto r = read_array(npy(descr, "(1,)", std::string(4, '\0')));
    CHECK(r.code() == Errc::unsupported);
    CHECK(contains(r.status().message(), "a.npz: x"));
  }
  TempFolder folder("npz_names");
  write_file(folder / "a.npz", make_zip({{"x.npy", npy("|S4", "()", std::string("ab\0\0", 4))},
                                         {"y.npy", npy("<U2", "(1,)", raw<std::uint32_t>({'h', 0xe9}))},
                                         {"z.npy", npy("<f8", "()", raw({1.0}))},
                                         {"readme.txt", "x"}}));
  const auto file = io::NpzFile::open(folder / "a.npz").value();
  CHECK(file.names() == std::vector<std::string>{"x", "y", "z"});
  CHECK(file.read_text("x").value() == "ab");
  CHECK(file.read_text("y").value() == "h?");
  CHECK(file.read_text("z").code() == Errc::invalid_file);
  CHECK(contains(file.read("none").status().message(), "there is no array 'none'"));
  CHECK(io::NpzFile::open(folder / "no.npz").code() == Errc::file_not_found);
  write_file(folder / "b.npz", "not a zip");
  CHECK(io::NpzFile::open(folder / "b.npz").code() == Errc::invalid_file);
}

TEST_CASE("npz: what is written is read back") {
  TempFolder folder("npz_write");
  const std::vector<float> f{1.5f, -2, 3, 4, 5, 6};
  const std::vector<double> d{0.1};
  const std::vector<std::int64_t> n{-1, 0, 1};
  for (const bool deflated : {false, true}) {
    const std::vector<io::NpzEntry> entries{{"f", {1, 2, 3}, f},
                                            {"d", {}, d},
                                            {"n", {3}, n},
                                            {"t", {}, std::string("smpl")},
                                            {"e", {0, 3}, std::span<const float>{}}};
    REQUIRE(io::save_npz(folder / "a.npz", entries, deflated).ok());
    const auto file = io::NpzFile::open(folder / "a.npz").value();
    CHECK(file.names() == std::vector<std::string>{"d", "e", "f", "n", "t"});
    CHECK(file.read("f").value().shape == std::vector<std::size_t>{1, 2, 3});
    CHECK(file.read("f").value().values == std::vector<double>(f.begin(), f.end()));
    CHECK(file.read("d").value().values == d);
    CHECK(file.read("n").value().values == std::vector<double>{-1, 0, 1});
    CHECK(file.read("e").value().shape == std::vector<std::size_t>{0, 3});
    CHECK(file.read_text("t").value() == "smpl");
    const std::string first = read_file(folder / "a.npz");
    REQUIRE(io::save_npz(folder / "b.npz", entries, deflated).ok());
    CHECK(read_file(folder / "b.npz") == first);
  }
  const auto code = [&](std::vector<io::NpzEntry> entries) {
    return io::save_npz(folder / "c.npz", entries).code();
  };
  CHECK(code({{"f", {7}, f}}) == Errc::invalid_argument);
  CHECK(code({{"f", {6}, f}, {"f", {6}, f}}) == Errc::invalid_argument);
  CHECK(code({{"../f", {6}, f}}) == Errc::invalid_argument);
  CHECK(code({{"", {6}, f}}) == Errc::invalid_argument);
  CHECK_FALSE(std::filesystem::exists(folder / "c.npz"));
  CHECK(io::save_npz(folder / "no/c.npz", {}).code() == Errc::file_not_found);
}

TEST_CASE("npz: changed bytes give an error that names the file, or an array") {
  TempFolder folder("npz_mutations");
  std::vector<float> values(300);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i);
  const std::vector<io::NpzEntry> entries{{"x", {3, 100}, values}, {"y", {300}, values}};
  std::mt19937 generator(5);
  int refused = 0;
  for (const bool deflated : {false, true}) {
    REQUIRE(io::save_npz(folder / "a.npz", entries, deflated).ok());
    const std::string whole = read_file(folder / "a.npz");
    for (int i = 0; i < 1500; ++i) {
      std::string bad = whole;
      if (i % 3 == 0) {
        bad.resize(generator() % bad.size());
      } else {
        bad[generator() % bad.size()] = static_cast<char>(generator());
      }
      write_file(folder / "b.npz", bad);
      reset_largest_allocation();
      const auto file = io::NpzFile::open(folder / "b.npz");
      Status s = file.status();
      for (const char* name : {"x", "y"}) {
        if (s.ok()) s = file->read(name).status();
      }
      // A claimed size may be as large as the slack for arrays that compress well.
      REQUIRE(largest_allocation() < (std::size_t{300} << 20));
      REQUIRE((s.ok() || contains(s.message(), "b.npz")));
      REQUIRE(s.code() != Errc::out_of_memory);
      refused += s.ok() ? 0 : 1;
    }
  }
  std::printf("npz: of 3000 mutations %d were refused\n", refused);
  CHECK(refused > 1500);
}
