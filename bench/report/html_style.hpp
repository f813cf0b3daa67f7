// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace gsnav_report {

/// The page's style sheet: light, one column of sections, charts side by side where there is room.
inline constexpr const char* kStyleSheet = R"css(
:root { color-scheme: light; }
* { box-sizing: border-box; }
body { margin: 0; background: #fff; color: #1f2730;
  font: 15px/1.5 system-ui, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; }
main, header > div, footer > div { max-width: 1320px; margin: 0 auto; padding: 0 20px; }
header { background: #f4f6f9; border-bottom: 1px solid #dde3ea; padding: 26px 0 18px; }
h1 { font-size: 26px; line-height: 1.25; margin: 0 0 8px; letter-spacing: -0.01em; }
h2 { font-size: 20px; margin: 38px 0 6px; padding-top: 14px; border-top: 1px solid #e3e8ee; }
h3 { font-size: 15px; margin: 20px 0 4px; color: #333c48; }
p { margin: 6px 0 10px; max-width: 78ch; }
.facts { display: flex; flex-wrap: wrap; gap: 2px 26px; margin: 0; color: #4a5563; font-size: 14px; }
.facts b { color: #1f2730; font-weight: 600; }
nav { margin-top: 10px; font-size: 14px; display: flex; flex-wrap: wrap; gap: 2px 16px; }
a { color: #0b5c93; text-decoration: none; }
a:hover { text-decoration: underline; }
.absent { color: #6b7684; font-style: italic; }
.note { color: #55606e; font-size: 14px; }
.scroll { overflow-x: auto; margin: 10px 0 14px; }
table { border-collapse: collapse; font-size: 13.5px; font-variant-numeric: tabular-nums; }
th, td { padding: 4px 11px; text-align: right; border-bottom: 1px solid #e6eaf0; white-space: nowrap; }
th { background: #f4f6f9; font-weight: 600; color: #3c4654; border-bottom: 1px solid #ccd4dd; vertical-align: bottom; }
th.name, td.name { text-align: left; }
td.wide { white-space: normal; min-width: 26ch; text-align: left; }
tbody tr:hover { background: #f8fafc; }
.pass { color: #0a6b3d; font-weight: 600; }
.miss { color: #b3261e; font-weight: 600; }
.verdict { font-size: 16px; margin: 10px 0 4px; }
.plots { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(350px, 100%), 1fr)); gap: 10px 18px; }
figure { margin: 0; min-width: 0; max-width: 560px; }
figure svg { width: 100%; height: auto; display: block; }
.images { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(300px, 100%), 1fr));
  gap: 16px; margin: 10px 0; }
.images img { width: 100%; height: auto; display: block; border: 1px solid #dde3ea; image-rendering: auto; }
figcaption { font-size: 13px; color: #4a5563; padding: 4px 0 0; overflow-wrap: anywhere; }
.legend { display: flex; flex-wrap: wrap; gap: 2px 18px; font-size: 13.5px; color: #3c4654; max-width: none; }
.legend span { white-space: nowrap; }
.legend svg { vertical-align: -1px; }
svg text { font-family: system-ui, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; }
.grid { stroke: #e9edf2; stroke-width: 1; }
.axis { stroke: #9aa4b1; stroke-width: 1; fill: none; }
.tick { font-size: 11px; fill: #55606e; }
.axis-title { font-size: 12px; fill: #333c48; }
.plot-title { font-size: 12.5px; font-weight: 600; fill: #1f2730; }
.label { font-size: 10.5px; paint-order: stroke; stroke: #fff; stroke-width: 3px; stroke-linejoin: round; }
details { margin: 10px 0; }
summary { cursor: pointer; color: #0b5c93; }
footer { color: #6b7684; font-size: 13px; padding: 26px 0 40px; }
@media (max-width: 600px) { h1 { font-size: 21px; } main, header > div, footer > div { padding: 0 12px; }
  th, td { padding: 4px 7px; } }
@media print { .scroll { overflow: visible; } h2 { break-after: avoid; } figure { break-inside: avoid; } }
)css";

}  // namespace gsnav_report
