// The content of a picture, as flags of `drape run` and `drape render`.
#pragma once

#include <CLI/CLI.hpp>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drape/v1/render.pb.h"

namespace drape::cli {

struct PictureFlags {
  std::array<uint32_t, 2> size_px = {960, 720};  // width, height
  std::string colour_by = "material";
  std::vector<double> camera;  // eye and target, 6 numbers; empty = fitted
  std::vector<double> view;    // direction of the fitted camera, 3 numbers; empty = the default
  std::vector<double> range;   // range of the colour scale, 2 numbers; empty = fitted
  bool has_no_legend = false;

  // The flags; each of them needs `render` where that is given.
  void AddTo(CLI::App& command, CLI::Option* render = nullptr);
  // Without session and cloths.
  v1::RenderRequest Request() const;
};

// A path that ends in .png.
CLI::Validator PictureFileValidator();

}  // namespace drape::cli
