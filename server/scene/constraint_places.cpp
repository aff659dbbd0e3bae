#include "server/scene/constraint_places.h"

#include <limits>

namespace drape {
namespace {

constexpr uint32_t kNoPlace = std::numeric_limits<uint32_t>::max();

}  // namespace

ConstraintPlaces::ConstraintPlaces(const SceneModel& model)
    : places_(model.described_constraint_count(), kNoPlace) {
  const auto sources = model.constraint_sources();
  for (uint32_t place = 0; place < sources.size(); ++place) places_[sources[place]] = place;
}

std::optional<uint32_t> ConstraintPlaces::Find(uint32_t source) const {
  if (source >= places_.size() || places_[source] == kNoPlace) return std::nullopt;
  return places_[source];
}

}  // namespace drape
