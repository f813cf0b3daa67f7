// SPDX-License-Identifier: Apache-2.0
#include "html.hpp"

#include <array>

#include "../../tools/common/html_text.hpp"
#include "gsnav/core/replace_file.hpp"
#include "html_sections.hpp"
#include "html_style.hpp"
#include "plot_pareto.hpp"

namespace gsnav_report {

using gsnav_tools::escape;

using gsnav::Status;

namespace {

struct Section {
  const char *id, *title, *intro;
  std::string (*make)(const Table&);
};

const std::array<Section, 10> kSections{{
    {"budgets", "Budgets", "The worst row of each profile against what it promises.", budget_section},
    {"targets", "Targets", "Pairs of settings compared, over all views of a scene.", target_section},
    {"pareto", "Speed against error",
     "Each mark is a setting on one backend: the mean over the views of all scenes, with a whisker to "
     "the "
     "worst view. Grey: another setting on that backend is as fast and as right, and better in one of "
     "the "
     "two. Dashed: the best that a given time buys. Hollow: measured on fewer views than the others, so "
     "that "
     "it beats no other setting. Response and compat modes change the correct image and are left out "
     "here.",
     pareto_section},
    {"knobs", "One knob at a time",
     "Everything else as in the exact profile, which each chart shows beside its values. Means over "
     "scenes, "
     "views and resolutions with whiskers to the worst; time is the geometric mean of the ratio to "
     "exact.",
     knob_section},
    {"settings", "All settings", "Means over views, the worst view in parentheses.", settings_section},
    {"images", "Difference images of the worst views", "", image_section},
    {"ledger", "Approximation ledger", "Approximations of each profile.", ledger_section},
    {"skinning", "Skinning", "", skinning_section},
    {"sweeps", "Capsule distances and sweeps", "", sweep_section},
    {"kernels", "Kernels", "Microbenchmarks, with the error against float64 beside the time.",
     kernel_section},
}};

constexpr const char* kHowToRead =
    "<section id=\"reading\">\n<h2>How to read this</h2>\n<p class=\"note\">A row is one view, drawn by "
    "one "
    "setting: a profile (exact, fast, lod) or exact with one knob turned. Its time is a median, its "
    "error "
    "is that of its image against an oracle, which computes the same image in float64. PSNR: above 60 "
    "dB "
    "no difference is visible, above 100 dB it is rounding. LSB: a step of 8 bits. Depth errors are in "
    "millimetres, over pixels where both have a depth. Compare settings within a scene, a size and a "
    "backend; times of two machines do not compare.</p>\n</section>\n";

std::string fact(const char* name, const std::string& value) {
  return value.empty() ? std::string()
                       : "<span>" + std::string(name) + " <b>" + escape(value) + "</b></span>\n";
}

}  // namespace

std::string html_page(const Table& table, bool acceptance) {
  const auto shown = [acceptance](const Section& s) {
    return acceptance || (s.make != budget_section && s.make != target_section);
  };
  std::string out =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
      "<title>gsnav: speed against error</title>\n<style>" +
      std::string(kStyleSheet) +
      "</style>\n</head>\n<body>\n<header><div>\n<h1>gsnav: speed against error</h1>\n";
  out += "<div class=\"facts\">\n" + fact("date", table.distinct("date")) +
         fact("machine", table.distinct("machine")) + fact("commit", table.distinct("commit")) +
         fact("backends", table.distinct("backend")) + fact("scenes", table.distinct("scene")) +
         "</div>\n<nav>\n";
  for (const Section& s : kSections) {
    if (!shown(s)) continue;
    out += "<a href=\"#" + std::string(s.id) + "\">" + s.title + "</a>\n";
  }
  out += "</nav>\n</div></header>\n<main>\n";
  out += kHowToRead;
  for (const Section& s : kSections) {
    if (!shown(s)) continue;
    const std::string body = s.make(table);
    out += "<section id=\"" + std::string(s.id) + "\">\n<h2>" + s.title + "</h2>\n";
    if (body.empty()) {
      out += "<p class=\"absent\">Nothing was measured for this section.</p>\n";
    } else {
      if (*s.intro != '\0') out += "<p class=\"note\">" + std::string(s.intro) + "</p>\n";
      out += body;
    }
    out += "</section>\n";
  }
  return out +
         "</main>\n<footer><div>Every error names the oracle that it was measured against; "
         "docs/reference/image_contract.md "
         "defines them. SSIM: Wang et al. 2004. FLIP: Andersson et al. 2020, 67 pixels per "
         "degree.</div></footer>\n"
         "</body>\n</html>\n";
}

Status write_html(const Table& table, const std::filesystem::path& path, bool acceptance) {
  return gsnav::replace_file(path, html_page(table, acceptance));
}

}  // namespace gsnav_report
