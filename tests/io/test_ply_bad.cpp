// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>
#include <sys/stat.h>

#include "allocations.hpp"
#include "check_refused.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "ply_file.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

PlyFile ply_with_rest(int rest = 0) {
  PlyFile file;
  file.properties = inria_properties(rest);
  file.rows = random_rows(5, rest, 11);
  return file;
}

void check_ply_fails(const std::string& text, Errc code, const std::string& part) {
  check_refused(io::parse_ply(bytes_of(text), "some.ply"), code, "some.ply", part);
}

}  // namespace

TEST_CASE("ply: cut off anywhere") {
  for (const char* format : {"binary_little_endian", "binary_big_endian"}) {
    PlyFile file = ply_with_rest(9);
    file.format = format;
    const std::string text = file.text();
    const std::size_t header = file.header().size(), stride = (text.size() - header) / 5;
    for (std::size_t n = 0; n < text.size(); ++n) {
      const auto result = io::parse_ply(bytes_of(text.substr(0, n)), "some.ply");
      REQUIRE(result.code() == Errc::invalid_file);
      if (n < header) continue;
      REQUIRE(contains(result.message(),
                       "promises 5 rows, " + std::to_string((n - header) / stride) + " are there"));
    }
  }
}

TEST_CASE("ply: ascii cut off, words that are no numbers") {
  PlyFile file = ply_with_rest();
  file.format = "ascii";
  const std::string text = file.text();
  const std::size_t third = text.find('\n', text.find('\n', file.header().size()) + 1) + 1;
  check_ply_fails(text.substr(0, third), Errc::invalid_file, "promises 5 rows, 2 are there");
  check_ply_fails(text.substr(0, third) + "1 2 x 4", Errc::invalid_file, "promises 5 rows, 2 are there");
  check_ply_fails(file.header(), Errc::invalid_file, "promises 5 rows, 0 are there");
}

TEST_CASE("ply: a count in the header is not trusted with memory") {
  for (const char* format : {"binary_little_endian", "ascii"}) {
    for (const char* count : {"1000000000", "18446744073709551615", "9223372036854775807", "6"}) {
      PlyFile file = ply_with_rest(45);
      file.format = format;
      file.count = count;
      const std::string text = file.text();
      reset_largest_allocation();
      check_ply_fails(text, Errc::invalid_file, std::string("promises ") + count + " rows, ");
      CHECK(largest_allocation() < 300000);
    }
  }
  PlyFile lists = ply_with_rest();
  lists.before_header = "element face 18446744073709551615\nproperty list uint int a\n";
  lists.before_rows = std::string("\xff\xff\xff\xff", 4);
  reset_largest_allocation();
  check_ply_fails(lists.text(), Errc::invalid_file,
                  "'face' promises 18446744073709551615 rows, 0 are there");
  CHECK(largest_allocation() < 300000);
}

TEST_CASE("ply: a list of negative length") {
  PlyFile file = ply_with_rest();
  file.before_header = "element face 1\nproperty list char uchar a\n";
  file.before_rows = "\xff";
  check_ply_fails(file.text(), Errc::invalid_file, "'face' promises 1 rows, 0 are there");
}

TEST_CASE("ply: each property that must be there is named") {
  for (const char* name : {"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1",
                           "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"}) {
    PlyFile file = ply_with_rest();
    std::erase_if(file.properties, [&](const auto& p) { return p.first == name; });
    check_ply_fails(file.text(), Errc::invalid_file, std::string("no property '") + name + "'");
  }
}

TEST_CASE("ply: numbers of f_rest that fit no degree") {
  for (const int rest : {1, 3, 8, 10, 15, 44, 46, 48, 71, 73, 105}) {
    PlyFile file = ply_with_rest(rest);
    check_ply_fails(file.text(), Errc::invalid_file, std::to_string(rest) + " properties f_rest_*");
  }
  PlyFile gap = ply_with_rest(9);
  for (auto& [name, type] : gap.properties) name = name == "f_rest_4" ? "f_rest_9" : name;
  check_ply_fails(gap.text(), Errc::invalid_file, "f_rest_4");
}

TEST_CASE("ply: headers that make no sense") {
  PlyFile file = ply_with_rest();
  const std::string text = file.text();
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string out = text;
    out.replace(out.find(from), from.size(), to);
    return out;
  };
  check_ply_fails("", Errc::invalid_file, "line 1");
  check_ply_fails("plyx\n", Errc::invalid_file, "begin with 'ply'");
  check_ply_fails(with("format binary_little_endian 1.0\n", ""), Errc::invalid_file, "no format");
  check_ply_fails(with("binary_little_endian", "binary_middle_endian"), Errc::invalid_file,
                  "binary_middle_endian");
  check_ply_fails(with("1.0", "2.0"), Errc::invalid_file, "'2.0'");
  check_ply_fails(with("element vertex 5", "element vertex -5"), Errc::invalid_file,
                  "'-5' is not a count");
  check_ply_fails(with("element vertex 5", "element vertex 5e9"), Errc::invalid_file,
                  "'5e9' is not a count");
  check_ply_fails(with("element vertex 5", "element vertex 99999999999999999999"), Errc::invalid_file,
                  "'99999999999999999999' is not a count");
  check_ply_fails(with("element vertex 5", "element vertex"), Errc::invalid_file, "'' is not a count");
  check_ply_fails(with("element vertex", "element points"), Errc::invalid_file, "no element 'vertex'");
  check_ply_fails(with("property float y", "property half y"), Errc::invalid_file, "'half' is no type");
  check_ply_fails(with("property float y", "property float x"), Errc::invalid_file,
                  "'x' of element 'vertex' comes twice");
  check_ply_fails(with("property float y", "property float"), Errc::invalid_file, "without a name");
  check_ply_fails(with("property float y", "property list float int y"), Errc::invalid_file,
                  "list's length");
  check_ply_fails(with("property float y", "property list uchar int y"), Errc::unsupported, "list");
  check_ply_fails(with("element vertex 5\n", "property float a\nelement vertex 5\n"), Errc::invalid_file,
                  "before any element");
  check_ply_fails(with("element vertex 5\n", "element vertex 1\nelement vertex 5\n"), Errc::invalid_file,
                  "comes twice");
  check_ply_fails(with("end_header\n", "whatever\nend_header\n"), Errc::invalid_file, "'whatever'");
  check_ply_fails(with("end_header\n", ""), Errc::invalid_file, "");
  std::string endless = "ply\nformat ascii 1.0\nelement vertex 1\n";
  for (int i = 0; i < 100000; ++i) endless += "property float p" + std::to_string(i) + "\n";
  check_ply_fails(endless, Errc::invalid_file, "longer than 1 MiB");
}

TEST_CASE("ply: what is no file") {
  TempFolder folder("ply_bad");
  CHECK(io::load_ply(folder / "none.ply").code() == Errc::file_not_found);
  CHECK(contains(io::load_ply(folder / "none.ply").message(), "none.ply"));
  CHECK(io::load_ply(folder.path()).code() == Errc::file_not_found);
  CHECK(io::load_ply("/dev/zero").code() == Errc::file_not_found);
  // Nobody writes to the pipe: whoever opens it waits.
  REQUIRE(::mkfifo((folder / "pipe.ply").c_str(), 0600) == 0);
  CHECK(io::load_ply(folder / "pipe.ply").code() == Errc::file_not_found);
}
