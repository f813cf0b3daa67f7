// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace gsnav_test {

/// Float tensors of a safetensors file, by name. Test files only: it trusts what it reads.
inline std::map<std::string, std::vector<float>> read_safetensors(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(file)), {});
  if (bytes.size() < 8) throw std::runtime_error("no safetensors header: " + path);
  std::uint64_t header_size = 0;
  std::memcpy(&header_size, bytes.data(), 8);
  const std::string header = bytes.substr(8, header_size);
  std::map<std::string, std::vector<float>> tensors;
  std::size_t at = 0;
  while ((at = header.find("\"dtype\"", at)) != std::string::npos) {
    const std::size_t close = header.rfind('"', header.rfind(':', at) - 1);
    const std::size_t open = header.rfind('"', close - 1);
    const std::string name = header.substr(open + 1, close - open - 1);
    const std::size_t offsets = header.find('[', header.find("\"data_offsets\"", at)) + 1;
    std::size_t used = 0;
    const std::size_t begin = std::stoul(header.substr(offsets), &used);
    const std::size_t end = std::stoul(header.substr(header.find(',', offsets) + 1));
    std::vector<float>& t = tensors[name];
    t.resize((end - begin) / sizeof(float));
    std::memcpy(t.data(), bytes.data() + 8 + header_size + begin, end - begin);
    ++at;
  }
  return tensors;
}

}  // namespace gsnav_test
