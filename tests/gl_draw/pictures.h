// Small scenes, and measurements of pictures.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <memory>
#include <vector>

#include "server/render/gl_draw/gl_renderer.h"

namespace drape::render {

inline std::unique_ptr<Renderer> MakeRenderer(const GlRendererOptions& options = {}) {
  Result<std::unique_ptr<Renderer>> renderer = CreateGlRenderer(options);
  DRAPE_CHECK(renderer.ok(), renderer.status().ToString());
  return std::move(renderer).value();
}

// One for all tests: its programs are compiled once.
class PictureTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { renderer_ = MakeRenderer(); }
  static void TearDownTestSuite() { renderer_.reset(); }

  static Picture Draw(const PictureSpec& spec, const std::vector<DrawnCloth>& cloths,
                      const DrawnStates& states) {
    Result<Picture> picture = renderer_->Draw(spec, cloths, states);
    DRAPE_CHECK(picture.ok(), picture.status().ToString());
    DRAPE_CHECK(picture->rgb.size() == size_t{3} * spec.width_px * spec.height_px, "all pixels");
    return std::move(picture).value();
  }

  inline static std::unique_ptr<Renderer> renderer_;
};

inline std::shared_ptr<const SceneModel> Build(const ModelDescription& description) {
  Result<std::shared_ptr<const SceneModel>> model = SceneModel::Build(description);
  DRAPE_CHECK(model.ok(), model.status().ToString());
  return std::move(model).value();
}

// `size_m` x `size_m` in the xz plane, from the origin.
inline std::shared_ptr<const SceneModel> GridModel(uint32_t side, double size_m = 1,
                                                   std::vector<uint32_t> pins = {}) {
  return Build(
      {.topology =
           GridTopology{.columns = side, .rows = side, .width_m = size_m, .height_m = size_m},
       .material = {},
       .pinned_particles = std::move(pins)});
}

// `count` particles along +x, `length_m` apart.
inline std::shared_ptr<const SceneModel> ChainModel(uint32_t count, double length_m = 0.1) {
  ParticleTopology chain;
  for (uint32_t i = 0; i < count; ++i) {
    chain.positions_m.push_back({length_m * i, 0, 0});
    chain.masses_kg.push_back(0.01);
    if (i > 0) chain.distance_constraints.push_back({i - 1, i, length_m, 0});
  }
  return Build({.topology = chain, .material = {}, .pinned_particles = {}});
}

using Map = std::function<Eigen::Vector3d(const Eigen::Vector3d&)>;

inline Eigen::Vector3d AsItIs(const Eigen::Vector3d& p) {
  return p;
}
// The grid's xz plane becomes the xy plane; its front looks along -z.
inline Eigen::Vector3d Upright(const Eigen::Vector3d& p) {
  return {p.x(), p.z(), 0};
}

// Positions of all cloths: where `map` puts the particles of their rest shapes. Speeds: `speed` of
// them along x.
inline DrawnStates HostStates(const std::vector<DrawnCloth>& cloths, const Map& map = AsItIs,
                              const std::function<double(const Eigen::Vector3d&)>& speed = {}) {
  std::vector<double> positions;
  std::vector<double> velocities;
  for (const DrawnCloth& cloth : cloths) {
    for (const Eigen::Vector3d& rest : cloth.model->rest_positions_m()) {
      const Eigen::Vector3d p = map(rest);
      positions.insert(positions.end(), {p.x(), p.y(), p.z()});
      velocities.insert(velocities.end(), {speed ? speed(rest) : 0.0, 0.0, 0.0});
    }
  }
  DrawnStates states;
  states.host.positions_m = std::move(positions);
  if (speed) states.host.velocities_m_per_s = std::move(velocities);
  return states;
}

// Looks along -z at `target` from `distance_m`; the picture is `height_m` high there.
inline Camera FrontCamera(const Eigen::Vector3d& target_m, double distance_m, double height_m) {
  return {.eye_m = target_m + distance_m * Eigen::Vector3d::UnitZ(),
          .target_m = target_m,
          .up = Eigen::Vector3d::UnitY(),
          .vertical_field_of_view_rad = 2 * std::atan(height_m / 2 / distance_m)};
}

inline PictureSpec SmallSpec(uint32_t width_px = 200, uint32_t height_px = 200) {
  PictureSpec spec;
  spec.width_px = width_px;
  spec.height_px = height_px;
  return spec;
}

struct Rgb {
  int red = 0;
  int green = 0;
  int blue = 0;
};

inline Rgb PixelOf(const Picture& picture, size_t x, size_t y) {
  const uint8_t* pixel = &picture.rgb[3 * (y * picture.width_px + x)];
  return {pixel[0], pixel[1], pixel[2]};
}

inline int Distance(const Rgb& a, const Rgb& b) {
  return std::max(
      {std::abs(a.red - b.red), std::abs(a.green - b.green), std::abs(a.blue - b.blue)});
}

// The place of the pixels for which `is_counted`, in pixels from the upper left corner.
struct Patch {
  size_t count = 0;
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
  Eigen::Vector3d mean_rgb = Eigen::Vector3d::Zero();
};

inline Patch Count(const Picture& picture,
                   const std::function<bool(size_t x, size_t y, const Rgb&)>& is_counted) {
  Patch patch;
  for (size_t y = 0; y < picture.height_px; ++y) {
    for (size_t x = 0; x < picture.width_px; ++x) {
      const Rgb pixel = PixelOf(picture, x, y);
      if (!is_counted(x, y, pixel)) continue;
      ++patch.count;
      patch.centroid += Eigen::Vector2d(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
      patch.mean_rgb += Eigen::Vector3d(pixel.red, pixel.green, pixel.blue);
    }
  }
  if (patch.count > 0) {
    patch.centroid /= static_cast<double>(patch.count);
    patch.mean_rgb /= static_cast<double>(patch.count);
  }
  return patch;
}

// Pixels that differ from another picture of the same size by more than `least` of 255.
inline Patch Difference(const Picture& picture, const Picture& other, int least = 8) {
  return Count(picture, [&](size_t x, size_t y, const Rgb& pixel) {
    return Distance(pixel, PixelOf(other, x, y)) > least;
  });
}

}  // namespace drape::render
