#include "server/api/view_validation.h"

#include <algorithm>
#include <limits>
#include <set>
#include <string>

#include "server/api/packed_vectors.h"

namespace drape::api {
namespace {

constexpr double kMaxCoverageRadius_m = 1e6;

bool CheckParticles(const FieldPath& path, const v1::StateView& view, Violations& violations) {
  const auto& particles = view.particles();
  if (!violations.Require(particles.size() <= kMaxViewParticles, path, [&] {
        return "names " + std::to_string(particles.size()) + " particles, at most " +
               std::to_string(kMaxViewParticles) + " are allowed; none means all";
      })) {
    return false;
  }
  for (int k = 1; k < particles.size() && !violations.is_full(); ++k) {
    violations.Require(particles[k] > particles[k - 1], path.At(k), [&] {
      return std::to_string(particles[k]) + " is not above " + std::to_string(particles[k - 1]) +
             ", the one before: strictly ascending indices are needed";
    });
  }
  return true;
}

std::shared_ptr<const Eigen::Matrix3Xd> CheckTarget(const FieldPath& path,
                                                    const v1::PackedArray& array,
                                                    Violations& violations) {
  const auto rows = CheckPackedRows(
      path, array, {v1::PackedArray::FLOAT32, v1::PackedArray::FLOAT64}, 3, violations);
  if (!rows) return nullptr;
  auto target = std::make_shared<Eigen::Matrix3Xd>(3, static_cast<Eigen::Index>(*rows));
  for (size_t row = 0; row < *rows && !violations.is_full(); ++row) {
    const Eigen::Vector3d place = PackedVector(array, row);
    violations.Require(place.allFinite() && place.cwiseAbs().maxCoeff() <= kMaxMagnitude,
                       path.At(row), [&] {
                         return NumberText(place.x()) + ", " + NumberText(place.y()) + ", " +
                                NumberText(place.z()) + " are not within " +
                                NumberText(kMaxMagnitude) + " m of the origin";
                       });
    target->col(static_cast<Eigen::Index>(row)) = place;
  }
  return target;
}

ReductionSpec CheckReductions(const FieldPath& path, const v1::StateView& view,
                              Violations& violations) {
  std::set<int> asked;
  for (int k = 0; k < view.reductions_size(); ++k) {
    const FieldPath at = path.Child("reductions").At(k);
    const int reduction = view.reductions(k);
    if (!CheckKnownEnum(at, reduction, v1::StateView::Reduction_descriptor(), violations)) continue;
    violations.Require(reduction != v1::StateView::REDUCTION_UNSPECIFIED, at,
                       [] { return std::string("names no reduction"); });
    violations.Require(asked.insert(reduction).second, at,
                       [] { return std::string("is there already: each once"); });
  }
  ReductionSpec spec{.coverage = asked.contains(v1::StateView::COVERAGE),
                     .centroid = asked.contains(v1::StateView::CENTROID),
                     .box = asked.contains(v1::StateView::BOX),
                     .target_distance = asked.contains(v1::StateView::TARGET_DISTANCE),
                     .coverage_radius_m = view.coverage_radius_m()};
  if (spec.coverage) {
    violations.InRange(path.Child("coverage_radius_m"), view.coverage_radius_m(),
                       Positive(kMaxCoverageRadius_m, "m"));
  }
  violations.Require(spec.coverage || view.coverage_radius_m() == 0,
                     path.Child("coverage_radius_m"),
                     [] { return std::string("is set, but COVERAGE is not asked for"); });
  violations.Require(spec.target_distance || !view.has_target_m(), path.Child("target_m"),
                     [] { return std::string("is set, but TARGET_DISTANCE is not asked for"); });
  if (spec.target_distance) {
    spec.target_m = CheckTarget(path.Child("target_m"), view.target_m(), violations);
  }
  return spec;
}

Status CheckHaveParticles(const FieldPath& path, const std::vector<uint32_t>& particles,
                          const ClothList& cloths) {
  if (particles.empty() || cloths.empty()) return Status::Ok();
  uint32_t count = std::numeric_limits<uint32_t>::max();  // of the smallest cloth
  ClothId smallest;
  for (const auto& cloth : cloths) {
    const uint32_t of_cloth = cloth->description()->model->described_particle_count();
    if (of_cloth >= count) continue;
    count = of_cloth;
    smallest = cloth->id;
  }
  Violations violations;
  const auto begin = particles.begin();
  const auto first = std::lower_bound(begin, particles.end(), count);
  for (auto particle = first; particle != particles.end() && !violations.is_full(); ++particle) {
    violations.Add(path.At(static_cast<size_t>(particle - begin)),
                   std::to_string(*particle) + " is not in [0, " + std::to_string(count - 1) +
                       "], the particles of cloth " + std::to_string(smallest.Packed()));
  }
  return violations.ToStatus();
}

Status CheckReducible(const FieldPath& path, const ReductionSpec& reductions,
                      const ClothList& cloths) {
  if (!reductions.any()) return Status::Ok();
  uint64_t total = 0;
  for (const auto& cloth : cloths) {
    const uint32_t particles = cloth->description()->model->described_particle_count();
    total += particles;
    if (!reductions.target_distance || reductions.target_m->cols() == particles) continue;
    return Status::InvalidField(path.Child("target_m").Child("shape").ToString(),
                                "is of " + std::to_string(reductions.target_m->cols()) +
                                    " particles, cloth " + std::to_string(cloth->id.Packed()) +
                                    " has " + std::to_string(particles));
  }
  if (total <= kMaxReducedParticles) return Status::Ok();
  return Status::InvalidField(path.Child("reductions").ToString(),
                              "are of cloths with " + std::to_string(total) +
                                  " particles, at most " + std::to_string(kMaxReducedParticles) +
                                  " are allowed in one request");
}

}  // namespace

StateFields ViewSpec::FieldsRead() const {
  if (!reductions.any()) return fields;
  return {.positions = true, .velocities = fields.velocities};
}

ViewSpec CheckView(const FieldPath& path, const v1::StateView& view, Violations& violations) {
  ViewSpec spec;
  CheckKnownEnum(path.Child("encoding"), view.encoding(), v1::StateView::Encoding_descriptor(),
                 violations);
  spec.encoding = view.encoding();
  spec.reductions = CheckReductions(path, view, violations);
  if (!CheckParticles(path.Child("particles"), view, violations)) return {};
  spec.fields = {.positions = view.positions() || (!view.velocities() && !spec.reductions.any()),
                 .velocities = view.velocities(),
                 .particles = {view.particles().begin(), view.particles().end()}};
  return spec;
}

Status CheckViewFits(const FieldPath& path, const ViewSpec& view, const ClothList& cloths) {
  DRAPE_RETURN_IF_ERROR(CheckHaveParticles(path.Child("particles"), view.fields.particles, cloths));
  return CheckReducible(path, view.reductions, cloths);
}

}  // namespace drape::api
