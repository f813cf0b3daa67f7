// SPDX-License-Identifier: Apache-2.0
#include <fstream>
#include <iterator>
#include <set>

#include "../../tools/common/html_text.hpp"
#include "html_sections.hpp"

namespace gsnav_report {

using gsnav_tools::base64;
using gsnav_tools::escape;
using gsnav_tools::format;
namespace {

std::string read_png(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(in)), {});
  return bytes.starts_with("\x89PNG\r\n\x1a\n") ? bytes : std::string();
}

}  // namespace

std::string image_section(const Table& table) {
  std::string out;
  std::set<std::string> shown;  // rows of several oracles may share an image
  for (const Row* row :
       select(table.of_kind("render"), [](const Row& r) { return !r.get("image").empty(); })) {
    const std::string& name = row->get("image");
    if (!shown.insert(name).second) continue;
    std::string caption = escape(setting_label(*row)) + " on " + escape(row->get("backend")) + ", " +
                          escape(row->get("scene")) + ", view " + escape(row->get("view")) + ", " +
                          escape(resolution(*row)) + ", against " + escape(row->get("oracle")) +
                          ": PSNR " + format(row->number("rgb_psnr"), 4) + " dB, FLIP " +
                          format(row->number("flip_mean"));
    const std::string png = read_png(table.folder() / name);
    out += "<figure>";
    if (png.empty()) {
      out += "<p class=\"absent\">" + escape(name) + " is no PNG that can be read.</p>";
    } else {
      out += "<img alt=\"" + caption + "\" src=\"data:image/png;base64," + base64(png) + "\"/>";
    }
    out += "<figcaption>" + caption + "</figcaption></figure>\n";
  }
  return out.empty() ? out : "<div class=\"images\">\n" + out + "</div>\n";
}

}  // namespace gsnav_report
