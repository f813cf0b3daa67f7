// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "gsnav/detail/sim/semantic.hpp"
#include "gsnav/scene/basic_renderer.hpp"

namespace gsnav_test {

/// Semantic image of one camera.
struct SemanticLabels {
  std::vector<float> labels;   ///< Shape [height][width]; see label_pixels.
  std::vector<float> weights;  ///< Shape [height][width]. Share of the pixel that the labelled object
                               ///< covers, 0 if the label is 0.
};

/// Renders the passes of a semantic sensor and labels the pixels. Meshes are numbered in their order.
template <class S, gsnav::Backend B>
SemanticLabels semantic_labels(B& backend, std::span<const gsnav::GaussianSet> sets,
                               std::vector<gsnav::MeshInstance> meshes, const gsnav::Camera& camera) {
  using namespace gsnav;
  std::size_t most = 0;
  for (const GaussianSet& set : sets) most = std::max(most, set.gaussians.size());
  SemanticPasses<B> passes(backend);
  passes.reserve(most);
  for (std::size_t i = 0; i < meshes.size(); ++i) meshes[i].id = static_cast<std::uint32_t>(i);
  BasicRenderer<S, B> renderer(backend, {});
  std::vector<std::vector<float>> shares;
  const std::size_t things = sets.size() + meshes.size();
  for (std::size_t pass = 0; pass < SemanticPasses<B>::count(things); ++pass) {
    const std::vector<MeshInstance> recolored = passes.recolored(meshes, sets.size(), pass);
    renderer.set_meshes(recolored);
    const auto drawn =
        renderer.render(passes.recolored(sets, pass), std::vector<Camera>{camera}).value();
    shares.emplace_back(drawn.rgb.begin(), drawn.rgb.end());
  }
  SemanticLabels out;
  out.labels.resize(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  label_pixels(shares, things, out.labels);
  for (std::size_t p = 0; p < out.labels.size(); ++p) {
    const std::size_t label = static_cast<std::size_t>(out.labels[p]);
    out.weights.push_back(label == 0 ? 0.0f : shares[(label - 1) / 3][3 * p + (label - 1) % 3]);
  }
  return out;
}

}  // namespace gsnav_test
