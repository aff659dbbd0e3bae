#include "server/api/view_validation.h"

#include <algorithm>
#include <limits>
#include <string>

namespace drape::api {

StateFields CheckView(const FieldPath& path, const v1::StateView& view, Violations& violations) {
  const auto& particles = view.particles();
  const FieldPath particles_path = path.Child("particles");
  if (particles.size() > kMaxViewParticles) {
    violations.Add(particles_path, "names " + std::to_string(particles.size()) +
                                       " particles, at most " + std::to_string(kMaxViewParticles) +
                                       " are allowed; none means all");
    return {};
  }
  for (int k = 1; k < particles.size() && !violations.is_full(); ++k) {
    violations.Require(particles[k] > particles[k - 1], particles_path.At(k), [&] {
      return std::to_string(particles[k]) + " is not above " + std::to_string(particles[k - 1]) +
             ", the one before: strictly ascending indices are needed";
    });
  }
  return {.positions = view.positions() || !view.velocities(),
          .velocities = view.velocities(),
          .particles = {particles.begin(), particles.end()}};
}

Status CheckClothsHaveParticles(const FieldPath& path, const StateFields& fields,
                                const ClothList& cloths) {
  if (fields.particles.empty() || cloths.empty()) return Status::Ok();
  uint32_t count = std::numeric_limits<uint32_t>::max();  // of the smallest cloth
  ClothId smallest;
  for (const auto& cloth : cloths) {
    const uint32_t particles = cloth->description()->model->described_particle_count();
    if (particles >= count) continue;
    count = particles;
    smallest = cloth->id;
  }
  Violations violations;
  const auto begin = fields.particles.begin();
  const auto first = std::lower_bound(begin, fields.particles.end(), count);
  for (auto particle = first; particle != fields.particles.end() && !violations.is_full();
       ++particle) {
    violations.Add(path.Child("particles").At(static_cast<size_t>(particle - begin)),
                   std::to_string(*particle) + " is not in [0, " + std::to_string(count - 1) +
                       "], the particles of cloth " + std::to_string(smallest.Packed()));
  }
  return violations.ToStatus();
}

}  // namespace drape::api
