// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace gsnav_viewer {

/// A request as far as the viewer reads it.
struct Request {
  std::string method;  ///< GET, HEAD or POST
  std::string path;    ///< begins with '/'; not decoded: what is served has plain names
  std::string host;    ///< Host field, empty in HTTP/1.0 without one
  std::string origin;  ///< Origin field, empty where there is none
  std::string
      site;  ///< Sec-Fetch-Site field, by which browsers say whose page asks; empty where there is none
  bool keep_alive = false;  ///< the client may send another request over the same connection
  std::size_t content_length = 0;
  std::string body;
};

/// What a head was: status 200 and the request, or the status to answer with.
struct ParsedRequest {
  int status = 200;
  Request request;
};

inline constexpr std::size_t kLongestHead = 8192;    ///< bytes; answered 431
inline constexpr std::size_t kLongestTarget = 1024;  ///< bytes; answered 414
inline constexpr std::size_t kLongestBody = 4096;    ///< bytes; answered 413

/// Reads a request's head, the empty line at its end included (RFC 9112, without what the viewer has no
/// need for: obsolete line folding, transfer codings, absolute targets). Never throws but bad_alloc.
ParsedRequest parse_request(std::string_view head);

/// Whether a Host field is an address (IPv4, or IPv6 in brackets), `localhost` or one of `names`, with
/// any port or none. A page of another site whose name was made to lead here (DNS rebinding) has that
/// site's name in it. With `loopback`, an address must be a loopback address.
bool is_allowed_host(std::string_view host, bool loopback, std::span<const std::string> names);

/// Whether a browser may have sent this for a page of another site: Origin names another host, or
/// Sec-Fetch-Site says so. Clients that send neither are no browsers.
bool is_from_elsewhere(const Request& request);

}  // namespace gsnav_viewer
