#include "server/solver/gl_compute/self_contact_measures.h"

#include "server/solver/self_contact/crossing_search.h"

namespace drape {

namespace {

std::vector<self_contact::Vector3d> InDouble(std::span<const float> positions) {
  std::vector<self_contact::Vector3d> result;
  for (size_t k = 0; k + 2 < positions.size(); k += 3) {
    result.push_back(self_contact::Vector3d{positions[k], positions[k + 1], positions[k + 2], 0});
  }
  return result;
}

}  // namespace

std::vector<uint32_t> FlagCrossings(const ContactSurface& surface,
                                    std::span<const float> positions) {
  const std::vector<bool> flags = self_contact::FlagCrossings(surface, InDouble(positions));
  return {flags.begin(), flags.end()};
}

void AddSelfContacts(const ContactSurface& surface, const ClothParameters& parameters,
                     std::span<const float> positions, Measurements& measured) {
  const double thickness_m = SelfContactOf(parameters).thickness_m;
  const self_contact::SelfContactMeasures its =
      self_contact::MeasureSelfContacts(surface, thickness_m, InDouble(positions))[0];
  Tell(its, measured);
}

}  // namespace drape
