// SPDX-License-Identifier: Apache-2.0
// gsnav-avatar: Gaussian avatars from rigged meshes, walks for them, and pictures of both.
#include <cstdio>

#include "commands.hpp"
#include "options.hpp"

int main(int argc, char** argv) {
  int exit_code = 0;
  const auto options = gsnav_avatar::parse_options(argc, argv, exit_code);
  if (!options) return exit_code;
  const gsnav::Status s = options->walk    ? gsnav_avatar::make_walk(*options->walk)
                          : options->strip ? gsnav_avatar::make_strip(*options->strip)
                                           : gsnav_avatar::make_from_mesh(*options->mesh, options->makehuman);
  if (s.ok()) return 0;
  std::fprintf(stderr, "gsnav-avatar: %s\n", s.message().c_str());
  return 1;
}
