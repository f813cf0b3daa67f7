// SPDX-License-Identifier: Apache-2.0
#include "http_request.hpp"

#include <arpa/inet.h>

#include <algorithm>
#include <charconv>
#include <utility>

namespace gsnav_viewer {
namespace {

constexpr std::string_view kEnd = "\r\n";

bool is_token(std::string_view s) {
  constexpr std::string_view kMarks = "!#$%&'*+-.^_`|~";
  return !s.empty() && std::all_of(s.begin(), s.end(), [&](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           kMarks.find(c) != std::string_view::npos;
  });
}

bool is_visible(std::string_view s) {
  return std::all_of(s.begin(), s.end(), [](char c) { return c > ' ' && c < 127; });
}

/// Returns true if the value of a field has no control characters.
bool is_value(std::string_view s) {
  return std::all_of(s.begin(), s.end(), [](char c) {
    return c == '\t' || (static_cast<unsigned char>(c) >= ' ' && c != 127);
  });
}

std::string_view trimmed(std::string_view s) {
  while (!s.empty() && (s.front() == ' ' || s.front() == '\t')) s.remove_prefix(1);
  while (!s.empty() && (s.back() == ' ' || s.back() == '\t')) s.remove_suffix(1);
  return s;
}

bool same_name(std::string_view a, std::string_view lower) {
  return std::equal(a.begin(), a.end(), lower.begin(), lower.end(), [](char x, char y) {
    return (x >= 'A' && x <= 'Z' ? static_cast<char>(x - 'A' + 'a') : x) == y;
  });
}

/// Returns true for ":" followed by digits.
bool is_port(std::string_view s) {
  return s.size() > 1 && s.size() < 7 && s.front() == ':' &&
         std::all_of(s.begin() + 1, s.end(), [](char c) { return c >= '0' && c <= '9'; });
}

std::string lower(std::string s) {
  for (char& c : s) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return s;
}

/// Takes the next line from `text`. Returns false if the line has no end.
bool take_line(std::string_view& text, std::string_view& line) {
  const std::size_t end = text.find(kEnd);
  if (end == std::string_view::npos) return false;
  line = text.substr(0, end);
  text.remove_prefix(end + kEnd.size());
  return true;
}

int parse_line(std::string_view line, Request& r, bool& needs_host) {
  const std::size_t a = line.find(' '), b = line.rfind(' ');
  if (a == std::string_view::npos || a == b) return 400;
  const std::string_view method = line.substr(0, a), target = line.substr(a + 1, b - a - 1),
                         version = line.substr(b + 1);
  if (!is_token(method)) return 400;
  if (target.size() > kLongestTarget) return 414;
  if (target.empty() || target.front() != '/' || !is_visible(target)) return 400;
  if (version != "HTTP/1.1" && version != "HTTP/1.0") return version.starts_with("HTTP/") ? 505 : 400;
  if (method != "GET" && method != "HEAD" && method != "POST") return 405;
  needs_host = version == "HTTP/1.1";
  r.keep_alive = needs_host;
  r.method = method;
  r.path = target.substr(0, target.find('?'));
  return 200;
}

}  // namespace

ParsedRequest parse_request(std::string_view head) {
  ParsedRequest out;
  const auto refuse = [](int status) { return ParsedRequest{status, {}}; };
  if (head.size() > kLongestHead) return refuse(431);
  std::string_view line;
  bool needs_host = false;
  if (!take_line(head, line)) return refuse(400);
  if (const int status = parse_line(line, out.request, needs_host); status != 200) return refuse(status);
  bool host = false, length = false, origin = false, site = false;
  while (take_line(head, line)) {
    if (line.empty()) {
      if (!head.empty()) return refuse(400);
      return needs_host && !host ? refuse(400) : out;
    }
    const std::size_t colon = line.find(':');
    if (colon == std::string_view::npos) return refuse(400);
    const std::string_view name = line.substr(0, colon), value = trimmed(line.substr(colon + 1));
    if (!is_token(name) || !is_value(value)) return refuse(400);
    if (same_name(name, "host")) {
      if (host) return refuse(400);
      host = true;
      out.request.host = value;
    } else if (same_name(name, "origin")) {
      if (std::exchange(origin, true)) return refuse(400);
      out.request.origin = value;
    } else if (same_name(name, "sec-fetch-site")) {
      if (std::exchange(site, true)) return refuse(400);
      out.request.site = value;
    } else if (same_name(name, "connection")) {
      if (same_name(value, "close")) out.request.keep_alive = false;
    } else if (same_name(name, "transfer-encoding")) {
      return refuse(501);
    } else if (same_name(name, "content-length")) {
      if (length || value.empty()) return refuse(400);
      length = true;
      const auto [end, error] =
          std::from_chars(value.data(), value.data() + value.size(), out.request.content_length);
      if (end != value.data() + value.size()) return refuse(400);
      if (error != std::errc{} || out.request.content_length > kLongestBody) return refuse(413);
    }
  }
  return refuse(400);
}

bool is_allowed_host(std::string_view host, bool loopback, std::span<const std::string> names) {
  if (host.starts_with('[')) {
    const std::size_t end = host.find(']');
    if (end == std::string_view::npos) return false;
    const std::string_view rest = host.substr(end + 1);
    if (!rest.empty() && !is_port(rest)) return false;
    in6_addr at{};
    const std::string address(host.substr(1, end - 1));
    if (inet_pton(AF_INET6, address.c_str(), &at) != 1) return false;
    return !loopback || IN6_IS_ADDR_LOOPBACK(&at);
  }
  const std::size_t colon = host.find(':');
  if (colon != std::string_view::npos && !is_port(host.substr(colon))) return false;
  const std::string name(host.substr(0, colon));
  if (same_name(name, "localhost")) return true;
  in_addr at{};
  if (inet_pton(AF_INET, name.c_str(), &at) == 1) return !loopback || (ntohl(at.s_addr) >> 24) == 127;
  return std::any_of(names.begin(), names.end(),
                     [&](const std::string& n) { return same_name(name, lower(n)); });
}

bool is_from_elsewhere(const Request& r) {
  if (!r.site.empty() && r.site != "same-origin" && r.site != "none") return true;
  // The origin is https behind a proxy that encrypts.
  return !r.origin.empty() && r.origin != "http://" + r.host && r.origin != "https://" + r.host;
}

}  // namespace gsnav_viewer
