#include "server/api/written_states.h"

#include <string>

#include "server/api/cloth_selection.h"
#include "server/api/field_checks.h"
#include "server/api/packed_vectors.h"
#include "server/solver/solver_constants.h"

namespace drape::api {
namespace {

using Eigen::Vector3d;

const FieldPath kWrittenPositions("positions_m");
const FieldPath kWrittenVelocities("velocities_m_per_s");

std::optional<size_t> CheckVectorRows(const FieldPath& path, const v1::PackedArray& array,
                                      Violations& violations) {
  return CheckPackedRows(path, array, {v1::PackedArray::FLOAT32, v1::PackedArray::FLOAT64}, 3,
                         violations);
}

// Adds nothing for a legal row; not for one that is not a number.
void CheckVectorRow(const FieldPath& path, size_t row, const Vector3d& vector, double max,
                    std::string_view unit, Violations& violations) {
  const bool is_legal = vector.cwiseAbs().maxCoeff() <= max && vector.allFinite();
  violations.Require(is_legal, path.At(row), [&] {
    return NumberText(vector.x()) + ", " + NumberText(vector.y()) + ", " + NumberText(vector.z()) +
           " are not within " + NumberText(max) + " " + std::string(unit);
  });
}

// The origin of the cloth's frame in that of the request.
Vector3d OriginIn(v1::WriteStatesRequest::Frame frame, const Placement& placement) {
  const Vector3d zero = Vector3d::Zero();
  return frame == v1::WriteStatesRequest::ENVIRONMENT ? placement.EnvironmentFromCloth(zero)
                                                      : placement.WorldFromCloth(zero);
}

}  // namespace

Status CheckWriteStates(const v1::WriteStatesRequest& request) {
  Violations violations;
  violations.AddAll(CheckNamesCloths(request.cloth_ids()).violations());
  CheckKnownEnum(FieldPath("frame"), request.frame(), v1::WriteStatesRequest::Frame_descriptor(),
                 violations);
  const std::optional<size_t> rows =
      CheckVectorRows(kWrittenPositions, request.positions_m(), violations);
  if (rows && request.has_velocities_m_per_s()) {
    const auto others =
        CheckVectorRows(kWrittenVelocities, request.velocities_m_per_s(), violations);
    if (others) violations.Length(kWrittenVelocities, *others, *rows, "a row per position");
  }
  return violations.ToStatus();
}

Result<std::vector<ParticleState>> ToStates(const v1::WriteStatesRequest& request,
                                            const ClothList& cloths) {
  Violations violations;
  size_t needed = 0;
  for (const auto& cloth : cloths) {
    needed += cloth->description()->model->described_particle_count();
  }
  violations.Length(kWrittenPositions, request.positions_m().shape(0), needed,
                    "a row per particle of each cloth");
  DRAPE_RETURN_IF_ERROR(violations.ToStatus());
  std::vector<ParticleState> states;
  size_t row = 0;
  for (const auto& cloth : cloths) {
    const auto model = cloth->description()->model;
    const Vector3d origin = OriginIn(request.frame(), cloth->placement);
    ParticleState& state = states.emplace_back();
    state.positions_m.assign(model->particle_count(), Vector3d::Zero());
    state.velocities_m_per_s.assign(model->particle_count(), Vector3d::Zero());
    for (uint32_t i = 0; i < model->described_particle_count(); ++i, ++row) {
      const uint32_t particle = model->ParticleOf(i);
      const Vector3d p = PackedVector(request.positions_m(), row) - origin;
      CheckVectorRow(kWrittenPositions, row, p, kMaxCoordinate_m, "m of the cloth's middle",
                     violations);
      state.positions_m[particle] = p;
      if (!request.has_velocities_m_per_s()) continue;
      const Vector3d v = PackedVector(request.velocities_m_per_s(), row);
      CheckVectorRow(kWrittenVelocities, row, v, kMaxSpeed_m_per_s / 2, "m/s", violations);
      state.velocities_m_per_s[particle] = v;
    }
    if (violations.is_full()) break;
  }
  DRAPE_RETURN_IF_ERROR(violations.ToStatus());
  return states;
}

}  // namespace drape::api
