// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace gsnav_viewer {

/// The parts of a request that the viewer reads.
struct Request {
  std::string method;  ///< GET, HEAD or POST.
  std::string path;    ///< Begins with '/'. Not decoded, because all served paths have plain names.
  std::string host;    ///< Host field. Empty in HTTP/1.0 without one.
  std::string origin;  ///< Origin field, or empty.
  std::string site;    ///< Sec-Fetch-Site field, or empty. Browsers use it to tell whether the request
                       ///< comes from another site.
  bool keep_alive = false;  ///< The client may send another request over the same connection.
  std::size_t content_length = 0;
  std::string body;
};

/// Result of parsing a head: status 200 and the request, or the status to answer with.
struct ParsedRequest {
  int status = 200;
  Request request;
};

inline constexpr std::size_t kLongestHead = 8192;    ///< Bytes. Longer ones are answered with 431.
inline constexpr std::size_t kLongestTarget = 1024;  ///< Bytes. Longer ones are answered with 414.
inline constexpr std::size_t kLongestBody = 4096;    ///< Bytes. Longer ones are answered with 413.

/// Parses the head of a request, including the empty line at its end (RFC 9112). Obsolete line folding,
/// transfer codings and absolute targets are not supported. Throws only bad_alloc.
ParsedRequest parse_request(std::string_view head);

/// Returns true if a Host field is an IP address (IPv6 in brackets), `localhost` or one of `names`, with
/// or without a port. This prevents DNS rebinding: a page of another site whose name was made to point
/// here has that site's name in the field.
/// @param loopback Accept only loopback addresses.
bool is_allowed_host(std::string_view host, bool loopback, std::span<const std::string> names);

/// Returns true if a browser may have sent the request for a page of another site: Origin has another
/// host, or Sec-Fetch-Site says so. Clients that send neither are not browsers.
bool is_from_elsewhere(const Request& request);

}  // namespace gsnav_viewer
