#include "server/api/connection_validation.h"

#include "server/api/topology_validation.h"
#include "server/scene/description_checks.h"
#include "server/session/cloth_record.h"

namespace drape::api {
namespace {

// The rest length of `given`, the message at `path`, into `connection`.
template <class Message, class Connection>
void SetRestLength(const FieldPath& path, const Message& given, double min_m,
                   Violations& violations, Connection& connection) {
  if (!given.has_rest_length_m()) {
    connection.rest_length_m = kRestShapeLength;
  } else {
    violations.InRange(path.Child("rest_length_m"), given.rest_length_m(),
                       {min_m, kMaxExtent_m, "m"});
  }
}

}  // namespace

std::vector<DistanceConstraint> CheckNewConstraints(const FieldPath& path,
                                                    const v1::Particles& particles,
                                                    Violations& violations) {
  std::vector<DistanceConstraint> constraints = ReadConstraints(path, particles, violations);
  for (size_t k = 0; k < constraints.size() && !violations.is_full(); ++k) {
    SetRestLength(path.Child("distance_constraints").At(k),
                  particles.distance_constraints(static_cast<int>(k)), kMinRestLength_m, violations,
                  constraints[k]);
  }
  return constraints;
}

std::vector<Spring> CheckNewSprings(const FieldPath& path, const v1::Particles& particles,
                                    Violations& violations) {
  std::vector<Spring> springs = ReadSprings(particles);
  for (size_t k = 0; k < springs.size() && !violations.is_full(); ++k) {
    SetRestLength(path.Child("springs").At(k), particles.springs(static_cast<int>(k)), 0,
                  violations, springs[k]);
  }
  return springs;
}

}  // namespace drape::api
