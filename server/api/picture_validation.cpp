#include "server/api/picture_validation.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "server/api/field_checks.h"

namespace drape::api {
namespace {

// Largest coordinate, as for the origins of environments.
constexpr double kMaxWorld_m = 1e12;
// Least distance between eye and target; below it, rounding decides the direction of view.
constexpr double kMinView_m = 1e-6;
// Least angle between up and the line of view; below it, rounding decides which way is up.
constexpr double kMinUpAngle_rad = 1e-3;
// A wider view would be all distortion, a narrower one all rounding.
constexpr double kMinFieldOfView_rad = 0.01;
constexpr double kMaxFieldOfView_rad = 3;
// Least width of a colour scale relative to its larger end: colours are computed in single
// precision.
constexpr double kMinRelativeRange = 1e-5;

Eigen::Vector3d Direction(const Eigen::Vector3d& v) {
  return (v / v.cwiseAbs().maxCoeff()).normalized();
}

// Sets `direction` to the unit vector along `values`; false after a violation.
bool CheckDirection(const FieldPath& path, const DoubleList& values, Eigen::Vector3d& direction,
                    Violations& violations) {
  const auto v = CheckVector3(path, values, kMaxMagnitude, "", violations);
  if (!v || !violations.Require(v->cwiseAbs().maxCoeff() >= kMinPositive, path, [] {
        return "has no direction: a component of at least " + NumberText(kMinPositive) +
               " is needed";
      })) {
    return false;
  }
  direction = Direction(*v);
  return true;
}

void CheckSize(const v1::RenderRequest& request, render::PictureSpec& spec,
               Violations& violations) {
  if (request.has_width_px()) spec.width_px = request.width_px();
  if (request.has_height_px()) spec.height_px = request.height_px();
  violations.CountInRange(FieldPath("width_px"), spec.width_px, kMinPictureEdge_px,
                          kMaxPictureEdge_px);
  violations.CountInRange(FieldPath("height_px"), spec.height_px, kMinPictureEdge_px,
                          kMaxPictureEdge_px);
}

// Both vectors are already valid; this checks the angle between them.
void CheckUpAngle(const FieldPath& path, const Eigen::Vector3d& up, const Eigen::Vector3d& view,
                  Violations& violations) {
  const double angle_rad = std::asin(std::min(1.0, up.cross(view).norm()));
  violations.Require(angle_rad >= kMinUpAngle_rad, path, [&] {
    return "is " + NumberText(angle_rad) + " rad from the line of view: at least " +
           NumberText(kMinUpAngle_rad) + " is needed";
  });
}

render::Camera CheckCamera(const v1::Camera& camera, Violations& violations) {
  const FieldPath path("camera");
  render::Camera result;
  const auto eye_m =
      CheckVector3(path.Child("eye_m"), camera.eye_m(), kMaxWorld_m, "m", violations);
  const auto target_m =
      CheckVector3(path.Child("target_m"), camera.target_m(), kMaxWorld_m, "m", violations);
  const bool has_up =
      camera.up().empty() || CheckDirection(path.Child("up"), camera.up(), result.up, violations);
  if (camera.has_vertical_field_of_view_rad()) {
    result.vertical_field_of_view_rad = camera.vertical_field_of_view_rad();
    violations.InRange(path.Child("vertical_field_of_view_rad"), result.vertical_field_of_view_rad,
                       {kMinFieldOfView_rad, kMaxFieldOfView_rad, "rad"});
  }
  if (!eye_m || !target_m) return result;
  result.eye_m = *eye_m;
  result.target_m = *target_m;
  const double distance_m = (*target_m - *eye_m).norm();
  if (!violations.Require(distance_m >= kMinView_m, path.Child("target_m"), [&] {
        return "is " + NumberText(distance_m) + " m from eye_m: at least " +
               NumberText(kMinView_m) + " m is needed";
      })) {
    return result;
  }
  if (has_up) CheckUpAngle(path.Child("up"), result.up, Direction(*target_m - *eye_m), violations);
  return result;
}

Eigen::AlignedBox3d CheckBox(const FieldPath& path, const DoubleList& corners,
                             Violations& violations) {
  Eigen::AlignedBox3d box;
  if (corners.empty() ||
      !violations.Length(path, corners.size(), 6, "a lowest and a highest corner") ||
      !CheckAllWithin(path, corners, kMaxWorld_m, "m", violations)) {
    return box;
  }
  bool is_ordered = true;
  for (int axis = 0; axis < 3; ++axis) {
    is_ordered &= violations.Require(corners[axis] <= corners[3 + axis], path.At(axis), [&] {
      return NumberText(corners[axis]) + " is above element " + std::to_string(3 + axis) + ", " +
             NumberText(corners[3 + axis]) + ": lowest <= highest corner";
    });
  }
  if (!is_ordered) return box;
  box.min() = Eigen::Vector3d(corners[0], corners[1], corners[2]);
  box.max() = Eigen::Vector3d(corners[3], corners[4], corners[5]);
  return box;
}

void CheckView(const v1::RenderRequest& request, render::PictureSpec& spec,
               Violations& violations) {
  const FieldPath path("fit");
  if (request.has_camera()) spec.camera = CheckCamera(request.camera(), violations);
  if (!request.has_fit()) return;
  violations.Require(!request.has_camera(), path,
                     [] { return "applies to a fitted camera only, but a camera is given"; });
  if (!request.fit().view_direction().empty()) {
    CheckDirection(path.Child("view_direction"), request.fit().view_direction(),
                   spec.view_direction, violations);
  }
  spec.include_m = CheckBox(path.Child("include_m"), request.fit().include_m(), violations);
}

render::Colouring CheckColouring(v1::RenderRequest::Colouring colouring, Violations& violations) {
  CheckKnownEnum(FieldPath("colouring"), colouring, v1::RenderRequest::Colouring_descriptor(),
                 violations);
  switch (colouring) {
    case v1::RenderRequest::STRAIN:
      return render::Colouring::kStrain;
    case v1::RenderRequest::COLOUR_GROUP:
      return render::Colouring::kColourGroup;
    case v1::RenderRequest::SPEED:
      return render::Colouring::kSpeed;
    case v1::RenderRequest::CONTACT:
      return render::Colouring::kContact;
    default:
      return render::Colouring::kMaterial;
  }
}

std::optional<render::ValueRange> CheckRange(const DoubleList& range, render::Colouring colouring,
                                             Violations& violations) {
  const FieldPath path("range");
  if (range.empty()) return {};
  const bool has_scale = colouring == render::Colouring::kStrain ||
                         colouring == render::Colouring::kSpeed ||
                         colouring == render::Colouring::kContact;
  if (!violations.Require(
          has_scale, path,
          [] { return "needs a colour scale, which only STRAIN, SPEED and CONTACT have"; }) ||
      !violations.Length(path, range.size(), 2, "lowest and highest value") ||
      !CheckAllWithin(path, range, kMaxMagnitude, "", violations)) {
    return {};
  }
  const double least =
      std::max(kMinPositive, kMinRelativeRange * std::max(std::abs(range[0]), std::abs(range[1])));
  if (!violations.Require(range[1] - range[0] >= least, path, [&] {
        return "[" + NumberText(range[0]) + ", " + NumberText(range[1]) +
               "]: the second must be larger than the first by at least " + NumberText(least);
      })) {
    return {};
  }
  return render::ValueRange{range[0], range[1]};
}

}  // namespace

Result<render::PictureSpec> CheckRender(const v1::RenderRequest& request) {
  Violations violations;
  Result<render::PictureSpec> result = render::PictureSpec();
  render::PictureSpec& spec = *result;
  CheckSize(request, spec, violations);
  CheckView(request, spec, violations);
  spec.colouring = CheckColouring(request.colouring(), violations);
  spec.range = CheckRange(request.range(), spec.colouring, violations);
  spec.has_legend = !request.hide_legend();
  spec.has_colliders = !request.hide_colliders();
  spec.has_pins = !request.hide_pins();
  spec.has_shadows = !request.hide_shadows();
  if (request.has_samples()) spec.samples = request.samples();
  violations.Require(spec.samples == 1 || spec.samples == 4, FieldPath("samples"),
                     [&spec] { return std::to_string(spec.samples) + ": 1 or 4 are allowed"; });
  CheckKnownEnum(FieldPath("encoding"), request.encoding(),
                 v1::RenderRequest::Encoding_descriptor(), violations);
  spec.is_raw = request.encoding() == v1::RenderRequest::RGB8;
  spec.has_depths = request.depths();
  spec.is_tiled = request.tiles();
  violations.Require(!spec.is_tiled || request.has_camera(), FieldPath("camera"),
                     [] { return std::string("is needed for tiles"); });
  DRAPE_RETURN_IF_ERROR(violations.ToStatus());
  return result;
}

Status CheckTiles(const render::PictureSpec& spec, size_t cloth_count) {
  const uint64_t pixels = uint64_t{spec.width_px} * spec.height_px * cloth_count;
  const uint64_t limit = spec.has_depths ? kMaxTiledPixels / 2 : kMaxTiledPixels;
  if (!spec.is_tiled || pixels <= limit) return Status::Ok();
  return Status::InvalidField("tiles", "are " + std::to_string(pixels) +
                                           " pixels together, at most " + std::to_string(limit) +
                                           (spec.has_depths ? " with depths" : "") +
                                           " are allowed");
}

}  // namespace drape::api
