// SPDX-License-Identifier: Apache-2.0
// gsnav-convert SCENE OUT.ply: any scene that the library reads, as an INRIA PLY.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>

#include "gsnav/io/ply.hpp"
#include "gsnav/io/scene_file.hpp"

int main(int argc, char** argv) {
  std::string scene, out;
  CLI::App app{"Writes a scene of 3D Gaussians as an INRIA PLY (float32), rows sorted in space."};
  app.add_option("scene", scene,
                 "What gsnav-render takes: a file, a SOG folder, or sibling tiles: DIR/2_0,2_1,2_2")
      ->required();
  app.add_option("out", out, "The PLY file")->required();
  CLI11_PARSE(app, argc, argv);
  const auto fail = [](const std::string& message) {
    std::fprintf(stderr, "gsnav-convert: %s\n", message.c_str());
    return 1;
  };
  const gsnav::Result<gsnav::LoadedCloud> loaded = gsnav::io::load_scene(scene);
  if (!loaded) return fail(loaded.message());
  for (const std::string& warning : loaded->report.warnings)
    std::fprintf(stderr, "warning: %s\n", warning.c_str());
  if (const gsnav::Status s = gsnav::io::save_ply(out, loaded->cloud); !s) return fail(s.message());
  std::printf("%s: %zu Gaussians of SH degree %d\n", out.c_str(), loaded->cloud.size(),
              loaded->cloud.sh_degree);
  return 0;
}
