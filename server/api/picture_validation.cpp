#include "server/api/picture_validation.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "server/api/field_checks.h"

namespace drape::api {
namespace {

// As of the origins of environments.
constexpr double kMaxWorld_m = 1e12;
// Between eye and target: closer, and the direction of view is a matter of rounding.
constexpr double kMinView_m = 1e-6;
// Between up and the line of view: closer, and which way is up is a matter of rounding.
constexpr double kMinUpAngle_rad = 1e-3;
// A wider view is all distortion, a narrower one all rounding.
constexpr double kMinFieldOfView_rad = 0.01;
constexpr double kMaxFieldOfView_rad = 3;
// Of a colour scale relative to its larger end: colours are computed in single precision.
constexpr double kMinRelativeRange = 1e-5;

Eigen::Vector3d Direction(const Eigen::Vector3d& v) {
  return (v / v.cwiseAbs().maxCoeff()).normalized();
}

// The unit vector along `values`, into `direction`; false after a violation.
bool CheckDirection(const FieldPath& path, const DoubleList& values, Eigen::Vector3d& direction,
                    FieldChecks& checks) {
  const auto v = checks.Vector3(path, values, kMaxMagnitude, "");
  if (!v || !checks.Require(v->cwiseAbs().maxCoeff() >= kMinPositive, path, [] {
        return "has no direction: a component of at least " + NumberText(kMinPositive) +
               " is needed";
      })) {
    return false;
  }
  direction = Direction(*v);
  return true;
}

void CheckSize(const v1::RenderRequest& request, render::PictureSpec& spec, FieldChecks& checks) {
  if (request.has_width_px()) spec.width_px = request.width_px();
  if (request.has_height_px()) spec.height_px = request.height_px();
  checks.CountInRange(FieldPath("width_px"), spec.width_px, kMinPictureEdge_px, kMaxPictureEdge_px);
  checks.CountInRange(FieldPath("height_px"), spec.height_px, kMinPictureEdge_px,
                      kMaxPictureEdge_px);
}

// Whether up and view are each good is known; how they fit is not.
void CheckUpAngle(const FieldPath& path, const Eigen::Vector3d& up, const Eigen::Vector3d& view,
                  FieldChecks& checks) {
  const double angle_rad = std::asin(std::min(1.0, up.cross(view).norm()));
  checks.Require(angle_rad >= kMinUpAngle_rad, path, [&] {
    return "is " + NumberText(angle_rad) + " rad from the line of view: at least " +
           NumberText(kMinUpAngle_rad) + " is needed";
  });
}

render::Camera CheckCamera(const v1::Camera& camera, FieldChecks& checks) {
  const FieldPath path("camera");
  render::Camera result;
  const auto eye_m = checks.Vector3(path.Child("eye_m"), camera.eye_m(), kMaxWorld_m, "m");
  const auto target_m = checks.Vector3(path.Child("target_m"), camera.target_m(), kMaxWorld_m, "m");
  const bool has_up =
      camera.up().empty() || CheckDirection(path.Child("up"), camera.up(), result.up, checks);
  if (camera.has_vertical_field_of_view_rad()) {
    result.vertical_field_of_view_rad = camera.vertical_field_of_view_rad();
    checks.InRange(path.Child("vertical_field_of_view_rad"), result.vertical_field_of_view_rad,
                   kMinFieldOfView_rad, kMaxFieldOfView_rad, "rad");
  }
  if (!eye_m || !target_m) return result;
  result.eye_m = *eye_m;
  result.target_m = *target_m;
  const double distance_m = (*target_m - *eye_m).norm();
  if (!checks.Require(distance_m >= kMinView_m, path.Child("target_m"), [&] {
        return "is " + NumberText(distance_m) + " m from eye_m: at least " +
               NumberText(kMinView_m) + " m is needed";
      })) {
    return result;
  }
  if (has_up) CheckUpAngle(path.Child("up"), result.up, Direction(*target_m - *eye_m), checks);
  return result;
}

Eigen::AlignedBox3d CheckBox(const FieldPath& path, const DoubleList& corners,
                             FieldChecks& checks) {
  Eigen::AlignedBox3d box;
  if (corners.empty() || !checks.Length(path, corners.size(), 6, "a lowest and a highest corner") ||
      !checks.AllWithin(path, corners, kMaxWorld_m, "m")) {
    return box;
  }
  bool is_ordered = true;
  for (int axis = 0; axis < 3; ++axis) {
    is_ordered &= checks.Require(corners[axis] <= corners[3 + axis], path.At(axis), [&] {
      return NumberText(corners[axis]) + " is above element " + std::to_string(3 + axis) + ", " +
             NumberText(corners[3 + axis]) + ": lowest <= highest corner";
    });
  }
  if (!is_ordered) return box;
  box.min() = Eigen::Vector3d(corners[0], corners[1], corners[2]);
  box.max() = Eigen::Vector3d(corners[3], corners[4], corners[5]);
  return box;
}

void CheckView(const v1::RenderRequest& request, render::PictureSpec& spec, FieldChecks& checks) {
  const FieldPath path("fit");
  if (request.has_camera()) spec.camera = CheckCamera(request.camera(), checks);
  if (!request.has_fit()) return;
  checks.Require(!request.has_camera(), path,
                 [] { return "is of a fitted camera, and a camera is given"; });
  if (!request.fit().view_direction().empty()) {
    CheckDirection(path.Child("view_direction"), request.fit().view_direction(),
                   spec.view_direction, checks);
  }
  spec.include_m = CheckBox(path.Child("include_m"), request.fit().include_m(), checks);
}

render::Colouring CheckColouring(v1::RenderRequest::Colouring colouring, FieldChecks& checks) {
  checks.KnownEnum(FieldPath("colouring"), colouring, v1::RenderRequest::Colouring_descriptor());
  switch (colouring) {
    case v1::RenderRequest::STRAIN:
      return render::Colouring::kStrain;
    case v1::RenderRequest::COLOUR_GROUP:
      return render::Colouring::kColourGroup;
    case v1::RenderRequest::SPEED:
      return render::Colouring::kSpeed;
    default:
      return render::Colouring::kMaterial;
  }
}

std::optional<render::ValueRange> CheckRange(const DoubleList& range, render::Colouring colouring,
                                             FieldChecks& checks) {
  const FieldPath path("range");
  if (range.empty()) return {};
  const bool has_scale =
      colouring == render::Colouring::kStrain || colouring == render::Colouring::kSpeed;
  if (!checks.Require(has_scale, path,
                      [] { return "is of a colour scale, which only STRAIN and SPEED have"; }) ||
      !checks.Length(path, range.size(), 2, "lowest and highest value") ||
      !checks.AllWithin(path, range, kMaxMagnitude, "")) {
    return {};
  }
  const double least =
      std::max(kMinPositive, kMinRelativeRange * std::max(std::abs(range[0]), std::abs(range[1])));
  if (!checks.Require(range[1] - range[0] >= least, path, [&] {
        return "[" + NumberText(range[0]) + ", " + NumberText(range[1]) +
               "]: the second must be larger than the first by at least " + NumberText(least);
      })) {
    return {};
  }
  return render::ValueRange{range[0], range[1]};
}

}  // namespace

Result<render::PictureSpec> CheckRender(const v1::RenderRequest& request) {
  FieldChecks checks;
  Result<render::PictureSpec> result = render::PictureSpec();
  render::PictureSpec& spec = *result;
  CheckSize(request, spec, checks);
  CheckView(request, spec, checks);
  spec.colouring = CheckColouring(request.colouring(), checks);
  spec.range = CheckRange(request.range(), spec.colouring, checks);
  spec.has_legend = !request.hide_legend();
  spec.has_colliders = !request.hide_colliders();
  spec.has_pins = !request.hide_pins();
  if (!checks.ok()) return checks.ToStatus();
  return result;
}

}  // namespace drape::api
