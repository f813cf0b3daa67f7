// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace gsnav_viewer {

/// A request as far as the viewer reads it.
struct Request {
  std::string method;  ///< GET, HEAD or POST
  std::string path;    ///< begins with '/'; not decoded: what is served has plain names
  std::string host;    ///< of the Host field, empty in HTTP/1.0 without one
  std::string origin;  ///< of the Origin field, empty where there is none
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

/// Reads a request's head, the empty line at its end included (RFC 9112, without what the viewer has no need for: obsolete
/// line folding, transfer codings, absolute targets). Never throws but bad_alloc.
ParsedRequest parse_request(std::string_view head);

/// Whether a Host field names this machine by its loopback addresses or as localhost, at `port`. A page from elsewhere
/// whose name was made to lead here (DNS rebinding) has another.
bool is_loopback_host(std::string_view host, int port);

}  // namespace gsnav_viewer
