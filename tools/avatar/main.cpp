// SPDX-License-Identifier: Apache-2.0
// gsnav-avatar: makes Gaussian avatars from rigged meshes, walks for them, and pictures of both.
#include <cstdio>

#include "commands.hpp"
#include "gsnav/core/replace_file.hpp"
#include "options.hpp"

namespace {

/// Checks, before any work, that the outputs of the command can be written.
gsnav::Status outputs_status(const gsnav_avatar::Options& o) {
  if (o.walk) return gsnav::check_output_path(o.walk->out);
  if (o.strip) return gsnav::check_output_path(o.strip->out);
  gsnav::Status s = gsnav::check_output_path(o.mesh->out);
  return s && !o.mesh->driver.empty() ? gsnav::check_output_path(o.mesh->driver) : s;
}

}  // namespace

int main(int argc, char** argv) {
  int exit_code = 0;
  const auto options = gsnav_avatar::parse_options(argc, argv, exit_code);
  if (!options) return exit_code;
  gsnav::Status s = outputs_status(*options);
  if (s) {
    s = options->walk    ? gsnav_avatar::make_walk(*options->walk)
        : options->strip ? gsnav_avatar::make_strip(*options->strip)
                         : gsnav_avatar::make_from_mesh(*options->mesh, options->makehuman);
  }
  if (s.ok()) return 0;
  std::fprintf(stderr, "gsnav-avatar: %s\n", s.message().c_str());
  return 1;
}
