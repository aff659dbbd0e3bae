// The description of a picture: plain values.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "server/scene/colliders.h"
#include "server/scene/placement.h"
#include "server/scene/scene_model.h"

namespace drape::render {

// A pinhole camera. World frame, metres.
struct Camera {
  Eigen::Vector3d eye_m = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d target_m = Eigen::Vector3d::Zero();  // the centre of the picture; not the eye
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();       // not along the view
  double vertical_field_of_view_rad = 0.6;             // of the whole picture, in (0, pi)
};

// The meaning of a cloth's colour.
enum class Colouring {
  kMaterial,     // one colour per cloth, to distinguish them
  kStrain,       // signed strain of largest magnitude among a particle's distance constraints [-]
  kColourGroup,  // the distance constraints as lines in the colour of their group (the solver's)
  kSpeed,        // |v| [m/s]
  kContact,  // sum of the sizes of the mean forces of a particle's contacts in the last step [N]
};

struct ValueRange {
  double low = 0;
  double high = 0;
};

struct PictureSpec {
  uint32_t width_px = 960;
  uint32_t height_px = 720;
  // Unset: fitted, looking along `view_direction` at all cloths and at `include_m`.
  std::optional<Camera> camera;
  Eigen::Vector3d view_direction = {-0.55, -0.42, -0.72};  // from the eye; any length > 0
  Eigen::AlignedBox3d include_m;  // world frame; may be empty. Keeps a series of pictures steady
  Colouring colouring = Colouring::kMaterial;
  // Range of the colour scale; unset: that of the values shown (strain: symmetric about 0).
  std::optional<ValueRange> range;
  bool has_legend = true;  // the colour scale; kMaterial has none
  bool has_colliders = true;
  bool has_pins = true;
  bool has_shadows = true;  // that the key light casts
  // Of each pixel: 4, whose mean its colour is, or 1, at its centre: edges are then jagged.
  uint32_t samples = 4;
  // Each cloth in a picture of its own, one below the other (tiles.h).
  bool is_tiled = false;
  // Pixels as they are in place of a file.
  bool is_raw = false;
  bool has_depths = false;  // Picture::depths_m
};

// One cloth of a picture, drawn where it is in the world.
struct DrawnCloth {
  std::shared_ptr<const SceneModel> model;
  Placement placement;
  std::vector<Collider> colliders;  // in the cloth's environment
};

struct Picture {
  uint32_t width_px = 0;
  uint32_t height_px = 0;
  std::vector<uint8_t> rgb;  // [height_px][width_px][3], sRGB, top row first
  // [height_px][width_px], top row first, if PictureSpec::has_depths: how far along the line of
  // view the nearest thing drawn is, at one point of the pixel; infinity: there is nothing.
  std::vector<float> depths_m;
  Camera camera;                 // the one that was used
  Eigen::AlignedBox3d bounds_m;  // of the drawn cloths and of PictureSpec::include_m
  ValueRange range;              // of the colour scale; 0, 0 without one
};

}  // namespace drape::render
